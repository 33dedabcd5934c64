//! State that is updated in place, and the type `Real` without its type argument.

use ppl::prelude::*;

use crate::densities::{assert_gradient, assert_same};

ppl::model! {
    fn updated(ys: &[f64]) {
        let a ~ Uniform(-1.0, 1.0);
        let step ~ Normal(0.0, 1.0).array::<4>();
        let mut h: Vec<Real> = step.to_vec();
        let mut l = vec![vec![Real::from(1.0); 2]; 2];
        h[0] /= (1.0 - a * a).sqrt();
        for t in 1..4 {
            h[t] += a * (h[t - 1] - 1.0);
        }
        l[1][0] *= l[0][0] * a;
        l[1][1] -= l[1][0];
        let mut t = 2;
        while t > 0 {
            t -= 1;
            h[t] /= h[t + 1].square() + 1.0;
        }
        for (t, y) in ys.iter().enumerate() {
            y ~ Normal(h[t] + l[1][1], 1.0);
        }
    }

    /// The model `updated`, in which every right-hand side is first assigned to a variable.
    fn by_name(ys: &[f64]) {
        let a ~ Uniform(-1.0, 1.0);
        let step ~ Normal(0.0, 1.0).array::<4>();
        let mut h = step.to_vec();
        let first = h[0] / (1.0 - a * a).sqrt();
        h[0] = first;
        for t in 1..4 {
            let next = h[t] + a * (h[t - 1] - 1.0);
            h[t] = next;
        }
        for t in [1, 0] {
            let next = h[t] / (h[t + 1].square() + 1.0);
            h[t] = next;
        }
        for (t, y) in ys.iter().enumerate() {
            y ~ Normal(h[t] + (1.0 - a), 1.0);
        }
    }

    fn typed(ys: &[f64]) {
        let m ~ Normal(0.0, 1.0).array::<2>();
        let pair: [Real; 2] = [m[0], m[1] * 2.0];
        let twice = |x: Real| -> Real { x * 2.0 };
        let both = pair.iter().copied().sum::<Real>();
        fn half<S: Scalar>(x: Real<S>) -> Real<S> {
            x / 2.0
        }
        let kept: Vec<Real> = ys.iter().map(|y| half(both * *y)).collect();
        for (y, kept) in ys.iter().zip(&kept) {
            let slope = pair.iter().zip([1.0, 0.5]).map(|(b, x)| *b * x).sum::<Real>();
            y ~ Normal(slope + twice(*kept), 1.0);
        }
        let shift ~ shifted(both);
        factor(-shift.square());
    }

    fn typed_in_full(ys: &[f64]) {
        let m ~ Normal(0.0, 1.0).array::<2>();
        let both = m[0] + m[1] * 2.0;
        for y in ys {
            y ~ Normal(m[0] + m[1] + both * *y, 1.0);
        }
        let shift ~ Normal(0.0, 1.0);
        factor(-(both + shift * 2.0).square());
    }

    fn shifted(level: Real) -> Real {
        let x ~ Normal(0.0, 1.0);
        let mut path: Vec<Real> = vec![level, x];
        path[0] += path[1] * 2.0;
        path[0]
    }
}

const YS: [f64; 4] = [0.3, -0.2, 1.1, 0.4];

#[test]
fn state_is_updated_in_place() {
    assert_gradient("updated", &updated(&YS));
    assert_same(&updated(&YS), &by_name(&YS));
}

#[test]
fn real_needs_no_argument() {
    assert_gradient("typed", &typed(&YS));
    assert_same(&typed(&YS), &typed_in_full(&YS));
}
