//! Mutable variables that start as literals and later depend on unknowns.

use ppl::prelude::*;
use ppl::{Bound, LogDensity, Model, Workspace};

fn half(x: f64) -> f64 {
    0.5 * x
}

fn doubled<S: Scalar>(total: &mut S, x: S) {
    *total += x * 2.0;
}

ppl::model! {
    fn from_literals(ys: &[f64], flag: bool) {
        let b ~ Normal(0.0, 1.0);
        let mut state = 0.0;
        let mut error = 0.0;
        for t in 1..ys.len() {
            state = 0.5 * state + b * ys[t - 1];
            let mean = state + 0.3 * error;
            error = ys[t] - mean;
            ys[t] ~ Normal(mean, 1.0);
        }
        let mut path = vec![0.0; ys.len()];
        let mut both = [[0.0, 1.0]; 2];
        for t in 1..ys.len() {
            path[t] = path[t - 1] * 0.5 + b;
            both[t % 2][0] += b * b;
        }
        let mut total = -1.0;
        for p in &path {
            if flag {
                total += *p;
            }
        }
        let mut last = 0.25;
        for (i, y) in ys.iter().enumerate() {
            if *y > 0.5 {
                last = b;
            } else if i == 1 {
                last = 0.0;
            }
        }
        let mut squares = [0.0, 0.0];
        for s in squares.iter_mut() {
            *s = b * b;
        }
        let mut list = vec![1.0];
        list.push(b);
        let mut twice = 0.0;
        doubled(&mut twice, b);
        let inner = {
            let mut sum = 0.0;
            for y in ys {
                sum += (b * y).sin();
            }
            sum
        };
        let part ~ summed(b, ys);
        // a variable that depends on unknowns only through conditions is a plain number, like data
        let mut count = 0.0;
        for s in &squares {
            if *s > 1e9 {
                count += squares.len() as f64;
            }
        }
        factor(0.0 * half(count));
        let mut length = 0.0;
        for y in ys {
            length += y.abs();
        }
        factor(-0.1 * (total * last + inner * half(length) + part).square());
        factor(-both[0][0] * both[1][1] - squares[1] - list[0] * list[1] + twice);
    }

    fn summed(b: Real, ys: &[f64]) -> Real {
        let mut total = 0.0;
        let mut weight = 1.0;
        for y in ys {
            weight *= 0.9;
            total += b * y * half(weight);
        }
        if total > 100.0 {
            total = 100.0;
        }
        total
    }

    /// The two arms observe different data, and so have different sufficient statistics.
    fn branching(ys: &[f64], others: &[f64]) {
        let b ~ Normal(0.0, 1.0);
        let mut state = 0.0;
        for y in ys {
            state = state * 0.5 + b * y;
        }
        if state > 0.0 {
            for y in ys {
                y ~ Normal(b, 1.0);
            }
        } else {
            for other in others {
                other ~ Normal(b, 1.0);
            }
        }
    }
}

fn value(model: &Bound<impl Model>, y: &[f64]) -> f64 {
    model.log_density(y, &mut Workspace::default()).expect("inside")
}

fn normal(y: f64, mean: f64) -> f64 {
    -0.5 * (y - mean).powi(2) - 0.5 * std::f64::consts::TAU.ln()
}

#[test]
fn variables_begin_as_literals() {
    let ys = [0.3, -1.2, 0.8];
    for b in [0.7, -0.4] {
        let mut expected = normal(b, 0.0);
        let (mut state, mut error) = (0.0, 0.0);
        for t in 1..3 {
            state = 0.5 * state + b * ys[t - 1];
            let mean = state + 0.3 * error;
            error = ys[t] - mean;
            expected += normal(ys[t], mean);
        }
        // path: 0, b, 1.5 b
        let total = -1.0 + 2.5 * b;
        let (last, length) = (b, 2.3);
        let inner: f64 = ys.iter().map(|y| (b * y).sin()).sum();
        let weights = [0.9, 0.81, 0.729];
        let part: f64 = ys.iter().zip(weights).map(|(y, w)| b * y * 0.5 * w).sum();
        expected -= 0.1 * (total * last + inner * 0.5 * length + part).powi(2);
        expected += -b * b - b * b - b + 2.0 * b;
        let model = from_literals(&ys, true);
        approx::assert_relative_eq!(value(&model, &[b]), expected, max_relative = 1e-13);
    }
    for flag in [true, false] {
        ppl::check::gradient(&from_literals(&ys, flag), 3);
    }
}

/// A branch on such a variable is a branch on unknowns: sufficient statistics are computed at every point.
#[test]
fn branches_on_variables_are_branches_on_unknowns() {
    let (ys, others) = ([0.3, 1.2, 0.8], [-0.4, 2.5]);
    let model = branching(&ys, &others);
    for b in [0.7, -0.7] {
        let data = if b > 0.0 { &ys[..] } else { &others };
        let expected = normal(b, 0.0) + data.iter().map(|y| normal(*y, b)).sum::<f64>();
        approx::assert_relative_eq!(value(&model, &[b]), expected, max_relative = 1e-13);
    }
}
