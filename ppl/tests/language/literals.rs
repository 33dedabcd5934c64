//! Literals together with unknowns: in arrays, in arrays of distributions, in the arms of branches.

use ppl::prelude::*;
use ppl::{Bound, Model};

ppl::model! {
    fn arrays(ys: &[f64], kinds: &[u64]) {
        let x ~ Normal(0.0, 1.0);
        let s ~ LogNormal(0.0, 0.5);
        for kind in kinds {
            factor([0.0, x + 0.5, -0.3][*kind as usize]);
        }
        for y in ys {
            y ~ Mixture([0.2, 0.5, 0.3], [Normal(x, 0.6), Normal(-0.5, s), Normal(x + s, 1.0)]);
        }
        for two in ys {
            two ~ Mixture(
                [0.4, 0.6],
                [Normal(x, 0.6).truncate(-9.0..9.0), Normal(0.1, s).truncate(-9.0..9.0)],
            );
        }
        let nested = [[0.5, x], [s, 1.0]];
        factor(-nested[0][0] * nested[0][1].square() - nested[1][0] * nested[1][1]);
        // an array without unknowns has the type of plain Rust
        let plain = [0.5, ys[0], -1.5];
        factor(plain.iter().sum::<f64>() * x);
    }

    /// The model `arrays` with every literal converted to `Real`.
    fn arrays_spelt_out(ys: &[f64], kinds: &[u64]) {
        let x ~ Normal(0.0, 1.0);
        let s ~ LogNormal(0.0, 0.5);
        let one = Real::from(1.0);
        for kind in kinds {
            factor([Real::from(0.0), x + 0.5, Real::from(-0.3)][*kind as usize]);
        }
        let narrow = Real::from(0.6);
        for y in ys {
            let ends = [Normal(x, narrow), Normal(Real::from(-0.5), s), Normal(x + s, one)];
            y ~ Mixture([0.2, 0.5, 0.3], ends);
        }
        for two in ys {
            let ends = [Normal(x, narrow), Normal(Real::from(0.1), s)];
            two ~ Mixture([0.4, 0.6], ends.map(|end| end.truncate(-9.0..9.0)));
        }
        factor(-0.5 * x.square() - s);
        factor((ys[0] - 1.0) * x);
    }

    /// Nested arrays, tuples, branches and blocks.
    fn nested(ys: &[f64]) {
        let x ~ Normal(0.0, 1.0);
        let mut g = [0.0; 2];
        for t in 0..ys.len() {
            let pair = if t == 0 { [0.0, 0.0] } else { [x, g[1]] };
            let called = if t == 0 { [0.0; 2] } else { [ln_sum_exp(&[g[0], x]), 0.5] };
            let (a, b) = match t {
                0 => (0.0, [1.0, 2.0]),
                1 => (x, [x, 0.5]),
                _ if t == 2 => (1.0, [0.0, x]),
                _ => {
                    let z = x + 1.0;
                    (z, [0.0, 0.0])
                }
            };
            let rows = [[0.0, 1.0], [x, 2.0], [if t > 1 { x } else { 0.0 }, { 3.0 }]];
            let square = if t == 0 { [[0.0; 2]; 2] } else { [[x, 1.0], [0.0, x]] };
            let kept = if t == 0 { [1.0, 0.0] } else { g };
            g = [0.5, kept[0] * called[0]];
            if t == 1 {
                g = [0.0; 2];
            }
            let all = pair[0] + called[1] + a + b[0] * b[1] + rows[2][0] * rows[0][1];
            ys[t] ~ Normal(all + square[1][1] + kept[1], 1.0);
        }
    }

    fn arms(ys: &[f64], flag: bool, kind: u8) {
        let x ~ Normal(0.0, 1.0);
        let a = if flag { x } else { 0.5 };
        let b = match kind {
            0 => -1.0,
            1 => {
                let y = x * 2.0;
                if flag { y } else { 0.25 }
            }
            _ if x > 100.0 => reject!("too large"),
            _ => (x * 0.5).exp(),
        };
        let c = 1.0 + x * if flag { 2.0 } else { x };
        let d = if flag {
            let own ~ Normal(0.0, 1.0);
            own
        } else {
            0.0
        };
        // an arm that never returns does not determine the type of the branch
        let e = if x > 100.0 { reject!("{x} is too large") } else { 0.5 };
        let inner ~ chosen(x, kind);
        for y in ys {
            y ~ Normal(a + b + c * d + e * inner, 1.0);
        }
    }

    fn chosen(x: Real, kind: u8) -> Real {
        let both = [x, 1.5];
        match kind {
            0 => both[0] * both[1],
            _ => 2.0,
        }
    }
}

#[test]
fn arrays_hold_literals_beside_unknowns() {
    let (ys, kinds) = ([0.3, -1.2, 0.8], [0, 2, 1, 1]);
    let (short, long) = (arrays(&ys, &kinds), arrays_spelt_out(&ys, &kinds));
    ppl::check::gradient(&short, 3);
    for y in [[0.3, -0.2], [-1.0, 0.5]] {
        approx::assert_relative_eq!(value(&short, &y), value(&long, &y), max_relative = 1e-13);
    }
}

fn value(model: &Bound<impl Model>, y: &[f64]) -> f64 {
    ppl::LogDensity::log_density(model, y, &mut ppl::Workspace::default()).expect("inside")
}

#[test]
fn arms_end_with_literals_beside_unknowns() {
    let ys = [0.3, -1.2];
    let normal = |y: f64| -0.5 * y * y - 0.5 * std::f64::consts::TAU.ln();
    let x = 0.7;
    for kind in 0..3 {
        let b = match kind {
            0 => -1.0,
            1 => 0.25,
            _ => f64::exp(0.5 * x),
        };
        let inner = if kind == 0 { 1.5 * x } else { 2.0 };
        // without the flag, c = 1 + x² and d = 0
        let mean = 0.5 + b + 0.5 * inner;
        let expected = normal(x) + ys.iter().map(|y| normal(y - mean)).sum::<f64>();
        let model = arms(&ys, false, kind);
        approx::assert_relative_eq!(value(&model, &[x]), expected, max_relative = 1e-13);
        ppl::check::gradient(&arms(&ys, true, kind), 3);
    }
}

#[test]
fn nested_literals_take_the_type_of_what_stands_beside() {
    let ys = [0.3, -1.2, 0.8, 0.1];
    let normal = |y: f64| -0.5 * y * y - 0.5 * std::f64::consts::TAU.ln();
    let x = 0.7_f64;
    let means =
        [2.0, x + 0.5 + x + x * 0.5 + x, x + 0.5 + 1.0 + x + x, x + 0.5 + (x + 1.0) + x + x];
    let expected = normal(x) + ys.iter().zip(means).map(|(y, mean)| normal(y - mean)).sum::<f64>();
    let model = nested(&ys);
    approx::assert_relative_eq!(value(&model, &[x]), expected, max_relative = 1e-13);
    ppl::check::gradient(&model, 3);
}
