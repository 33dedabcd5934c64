//! Means that add up in loops, as one writes them without `dot`.

use ppl::prelude::*;

use crate::{Counted, assert_derivatives, wave};

struct Case {
    group: usize,
    x: Vec<f64>,
    more: Vec<f64>,
    weight: f64,
    y: f64,
}

ppl::model! {
    fn indices(cases: &Counted<Case>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 2.0).array::<3>();
        let sd ~ HalfNormal(2.0);
        for case in cases.iter() {
            let x = &case.x;
            let mut mean = a;
            for d in 0..3 {
                mean += b[d] * x[d];
            }
            case.y ~ Normal(mean, sd);
        }
    }

    /// Pairs of both, with data before, in and behind the sum.
    fn pairs(cases: &Counted<Case>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 2.0).array::<3>();
        let sd ~ HalfNormal(2.0);
        for case in cases.iter() {
            let level = a * case.weight;
            let mut mean = level - 0.5;
            for (b, x) in b.iter().zip(&case.x) {
                mean -= b * x * case.weight;
            }
            mean += case.weight - b[0];
            let half = mean / 2.0;
            case.y ~ Normal(case.weight * half + a, sd);
        }
    }

    /// Two coefficients a turn, one unknown for all turns, and what has no unknown.
    fn turns(cases: &Counted<Case>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 2.0).array::<3>();
        let scale ~ HalfNormal(1.0);
        for case in cases.iter() {
            let mut mean = Real::from(0.0);
            for (d, x) in case.x.iter().enumerate() {
                mean += scale * b[d] * x - a * x.square() + 0.5 * x;
            }
            case.y ~ Normal(mean, scale.exp());
        }
    }

    /// The loop calls an unknown as the data were called.
    fn renamed(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 2.0).array::<3>();
        for case in cases.iter() {
            let x = &case.x;
            let mut mean = b[0];
            for (x, y) in b.iter().zip(x) {
                mean += x * y;
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    /// With iterators, in a name and in place.
    fn iterated(cases: &Counted<Case>) {
        let a ~ Normal(0.0, 3.0);
        let b ~ Normal(0.0, 2.0).array::<3>();
        let sd ~ HalfNormal(2.0);
        for case in cases.iter() {
            let slope = b.iter().zip(&case.x).map(|(b, x)| b * x).sum::<Real<_>>();
            case.y ~ Normal(a + case.weight * slope
                - (0..3).map(|d| a * case.x[d] + 0.1).sum::<Real<_>>() / 2.0, sd);
        }
    }

    /// Unknowns by group in two ways, backwards, and loops of data beside.
    fn by_group(cases: &Counted<Case>, weights: &[f64]) {
        let b ~ Normal(0.0, 2.0).array::<3>().iid(4);
        let c ~ Normal(0.0, 2.0).array::<3>().iid(4);
        let sd ~ HalfNormal(2.0);
        for case in cases.iter() {
            let g = case.group;
            let mut mean = c[g][1];
            for (b, x) in b[g].iter().zip(&case.x) {
                mean += *b * *x;
            }
            for d in (0..3).rev() {
                mean += c[case.group][d] * weights[d] * case.x[d];
            }
            for w in weights.iter() {
                mean += w * case.weight;
            }
            case.y ~ Normal(mean, sd);
        }
    }

    /// An array whose length is known later, and names that other loops use for other things.
    fn of_any_length(cases: &Counted<Case>, ys: &[f64]) {
        let b ~ Normal(0.0, 2.0).iid(3);
        for case in b.iter() {
            factor(-0.1 * case.square());
        }
        for y in ys {
            y ~ Normal(b.iter().map(|b| *b * 0.5).sum::<Real<_>>(), 3.0);
        }
        for case in cases.iter() {
            let mut mean = b[0] * case.weight;
            for d in 0..3 {
                mean += b[d] * case.x[d];
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    /// As many numbers for all observations, but not in the same loops.
    fn of_two_kinds(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 2.0).array::<3>();
        let c ~ Normal(0.0, 2.0).array::<3>();
        for case in cases.iter() {
            let mut mean = 0.0;
            for d in 0..case.x.len() {
                mean += b[d] * case.x[d];
            }
            for (c, x) in c.iter().zip(&case.more) {
                mean += c * x;
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    // what rows cannot stand for

    fn members(cases: &Counted<Case>) {
        let z ~ Normal(0.0, 1.0).iid(5);
        for case in cases.iter() {
            let mut mean = 0.0;
            for d in 0..2 {
                mean += z[case.group + d] * case.x[d];
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    fn moved(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let first = case.group;
            let last = first + 2;
            let mut mean = 0.0;
            for d in first..last {
                mean += b[d] * case.x[d];
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    fn backwards(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let mut mean = 0.0;
            for (d, x) in (0..case.x.len()).rev().zip(&case.more) {
                mean += b[d] * x;
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    fn curved(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let mut mean = 0.0;
            for d in 0..3 {
                mean += (b[d] * case.x[d]).tanh();
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    /// A sum in the turns of another.
    fn doubled(cases: &Counted<Case>, weights: &[f64]) {
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let mut sum = 0.0;
            for d in 0..3 {
                sum += b[d] * case.x[d];
            }
            let mut mean = b[0];
            for w in weights.iter() {
                mean += sum * w;
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    fn unnamed(cases: &Counted<Case>) {
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let mut sum = 0.0;
            for d in 0..3 {
                sum += b[d] * case.x[d];
            }
            let mut mean = b[0];
            for _ in 0..2 {
                mean += sum;
            }
            case.y ~ Normal(mean, 1.0);
        }
    }

    /// `d` is two things.
    fn hidden(cases: &Counted<Case>) {
        let a ~ Normal(0.0, 1.0);
        let b ~ Normal(0.0, 1.0).array::<3>();
        for case in cases.iter() {
            let d = a * case.weight;
            let mut mean = d;
            for d in 0..3 {
                mean += b[d] * case.x[d];
            }
            case.y ~ Normal(mean, 1.0);
        }
    }
}

fn cases(length: impl Fn(usize) -> usize) -> Counted<Case> {
    let case = |i: usize| Case {
        group: i * i % 4,
        x: (0..length(i)).map(|d| wave(i, d)).collect(),
        more: (0..4 - length(i)).map(|d| wave(i, d + 5)).collect(),
        weight: wave(i, 3),
        y: wave(i, 4),
    };
    Counted::new((0..80).map(case).collect())
}

#[test]
fn sums_that_are_loops_are_as_good_as_products() {
    let data = cases(|_| 3);
    let weights = [0.3, -0.7, 1.1];
    assert_derivatives(&indices(&data));
    assert_eq!(data.looks(&indices(&data)), 1);
    assert_derivatives(&pairs(&data));
    assert_eq!(data.looks(&pairs(&data)), 1);
    assert_derivatives(&turns(&data));
    assert_eq!(data.looks(&turns(&data)), 1);
    assert_derivatives(&renamed(&data));
    assert_eq!(data.looks(&renamed(&data)), 1);
    assert_derivatives(&iterated(&data));
    assert_eq!(data.looks(&iterated(&data)), 1);
    assert_derivatives(&of_any_length(&data, &[0.3, -0.1]));
    assert_eq!(data.looks(&of_any_length(&data, &[0.3, -0.1])), 1);
    // squares are 0 and 1 modulo 4
    assert_derivatives(&by_group(&data, &weights));
    assert_eq!(data.looks(&by_group(&data, &weights)), 2);
    let data = cases(|i| 1 + 2 * (i % 2));
    assert_derivatives(&of_two_kinds(&data));
    assert_eq!(data.looks(&of_two_kinds(&data)), 2);
}

#[test]
fn sums_over_other_unknowns_are_looked_at_one_by_one() {
    let data = cases(|_| 3);
    assert_derivatives(&members(&data));
    assert_derivatives(&moved(&data));
    assert_derivatives(&curved(&data));
    assert_derivatives(&hidden(&data));
    assert_derivatives(&doubled(&data, &[0.5, -1.5, 0.3]));
    assert_derivatives(&unnamed(&data));
    // rows of 1 + 3 numbers and of 3 + 1
    let data = cases(|i| 1 + 2 * (i % 2));
    assert_derivatives(&backwards(&data));
    // of 3 and of 2
    let data = cases(|i| 2 + i % 2);
    assert_derivatives(&of_two_kinds(&data));
    assert_derivatives(&indices(&cases(|i| 3 + i % 2)));
    assert_eq!(data.looks(&backwards(&data)), 80);
}
