//! Sums written as loops are formulas, with the value and the gradient of the same sum by `dot`.

use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn with_dot(x: &[[f64; 3]], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<3>();
        let level ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(level + dot(row, &slope), sd);
        }
    }

    fn with_index(x: &[[f64; 3]], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<3>();
        let level ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = level + slope[0] * row[0];
            for d in 1..3 {
                mean += slope[d] * row[d];
            }
            y ~ Normal(mean, sd);
        }
    }

    /// A sum that starts from a number, over unknowns zipped with data, with a further term after the loop.
    fn with_zip(x: &[[f64; 3]], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<3>();
        let level ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = Real::from(0.0);
            for (slope, x) in slope.iter().zip(row) {
                mean -= -(slope * x);
            }
            mean += level;
            let shifted = mean * 1.0;
            y ~ Normal(shifted, sd);
        }
    }

    /// Sums by iterators: as a variable, as a part of a formula, and as the argument of a function.
    fn with_iterators(x: &[[f64; 3]], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<3>();
        let level ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            let sum = (0..3).map(|d| slope[d] * row[d]).sum::<Real<_>>();
            let mean = level - slope.iter().zip(row).map(|(slope, x)| slope * x).sum::<Real<_>>();
            let positive = slope.iter().map(|s| s.square()).sum::<Real<_>>().sqrt();
            y ~ Normal(mean + 2.0 * sum, sd + positive - positive);
        }
    }

    /// A sum that is used and changed afterwards, under a loop variable that shadows an unknown; a sum of integers
    /// stays an integer.
    fn used_twice(x: &[[f64; 3]], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<3>();
        let level ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for i in 0..y.len() {
            let mut mean = level;
            let mut count = 0;
            for level in 0..3 {
                mean += slope[level] * x[i][level];
            }
            for slope in 0..3 {
                count += slope;
            }
            if count > 2 {
                mean += 0.5 * mean - 0.5 * mean;
            }
            #[track] let doubled = mean + mean;
            y[i] ~ Normal(doubled - mean, sd);
        }
    }

    /// A sum outside a plate, used in a factor.
    fn once(x: &[f64; 3]) {
        let z ~ Normal(0.0, 1.0).array::<3>();
        let mut sum = 0.3 * z[0].exp();
        for d in 0..3 {
            sum += x[d] * z[d].sin();
        }
        factor(-sum.square());
    }
}

fn gradient(model: &Bound<impl Model>, y: &[f64]) -> (f64, Vec<f64>) {
    let (mut w, mut compiled, mut dual) =
        (Workspace::default(), vec![0.0; y.len()], vec![0.0; y.len()]);
    let value = model.gradient(y, &mut compiled, &mut w).expect("inside");
    model.forward_gradient(y, &mut dual).expect("inside");
    for (c, d) in compiled.iter().zip(&dual) {
        assert!((c - d).abs() <= 1e-12 * (1.0 + d.abs()), "{compiled:?} {dual:?}");
    }
    (value, compiled)
}

#[test]
fn loops_are_sums() {
    let x = [[1.0, 0.2, -0.7], [1.0, -0.3, 0.5], [1.0, 1.1, 0.1], [1.0, 0.0, 2.0]];
    let y = [0.3, -0.8, 1.9, 0.4];
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let reference = with_dot(&x, &y);
    for _ in 0..20 {
        let at = reference.draw_prior(&mut rng).expect("proper").unconstrained;
        let (value, expected) = gradient(&reference, &at);
        for (found, gradient) in [
            gradient(&with_index(&x, &y), &at),
            gradient(&with_zip(&x, &y), &at),
            gradient(&used_twice(&x, &y), &at),
            gradient(&with_iterators(&x, &y), &at),
        ] {
            assert!((found - value).abs() <= 1e-13 * (1.0 + value.abs()), "{found} {value}");
            for (g, e) in gradient.iter().zip(&expected) {
                assert!((g - e).abs() <= 1e-12 * (1.0 + e.abs()), "{gradient:?} {expected:?}");
            }
        }
    }
}

#[test]
fn a_sum_outside_a_plate() {
    let x = [0.5, -1.0, 2.0];
    let z = [0.2, -0.4, 1.3f64];
    let (value, found) = gradient(&once(&x), &z);
    let sum = 0.3 * z[0].exp() + (0..3).map(|d| x[d] * z[d].sin()).sum::<f64>();
    let normal: f64 = z.iter().map(|z| -0.5 * z * z - 0.5 * std::f64::consts::TAU.ln()).sum();
    approx::assert_relative_eq!(value, normal - sum * sum, max_relative = 1e-14);
    for d in 0..3 {
        let slope = x[d] * z[d].cos() + if d == 0 { 0.3 * z[0].exp() } else { 0.0 };
        approx::assert_relative_eq!(found[d], -z[d] - 2.0 * sum * slope, max_relative = 1e-13);
    }
}
