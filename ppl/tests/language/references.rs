//! References to unknowns, from loops over arrays, have the value and gradient of the unknowns.

use ppl::prelude::*;

use crate::densities::assert_same;

ppl::model! {
    fn by_reference(x: &[[f64; 2]], y: &[f64]) {
        let mu ~ Normal(0.0, 1.0);
        let tau ~ HalfNormal(1.0);
        let theta ~ Normal(mu, tau).iid(y.len());
        let b ~ Normal(0.0, 1.0).array::<2>();
        for (theta, y) in theta.iter().zip(y) {
            y ~ Normal(theta, 1.0);
        }
        let twice: Vec<_> = theta.iter().map(|theta| 2.0 * theta - tau / theta + -theta).collect();
        let angles: Real<_> = theta.iter().map(|theta| theta.atan2(tau).clamp(-1.0, mu.square())).sum();
        let predictor = |row: &[f64; 2]| b.iter().zip(row).map(|(b, x)| b * x).sum::<Real<_>>();
        let level: Real<_> = twice.iter().sum();
        for (row, y) in x.iter().zip(y) {
            let again = y;
            again ~ Normal(level + angles + predictor(row), &tau);
        }
    }

    fn by_value(x: &[[f64; 2]], y: &[f64]) {
        let mu ~ Normal(0.0, 1.0);
        let tau ~ HalfNormal(1.0);
        let theta ~ Normal(mu, tau).iid(y.len());
        let b ~ Normal(0.0, 1.0).array::<2>();
        let mut level = Real::from(0.0);
        for i in 0..y.len() {
            y[i] ~ Normal(theta[i], 1.0);
            level += 2.0 * theta[i] - tau / theta[i] - theta[i];
            let angle = (theta[i] / tau).atan();
            level += if angle < -1.0 { Real::from(-1.0) } else if angle > mu.square() { mu.square() } else { angle };
        }
        for (row, y) in x.iter().zip(y) {
            let again = y;
            again ~ Normal(level + b[0] * row[0] + b[1] * row[1], tau);
        }
    }
}

#[test]
fn references_are_read_as_what_they_refer_to() {
    let (x, y) = ([[0.3, -1.0], [2.0, 0.5], [1.0, 1.0]], [0.4, -0.7, 1.9]);
    assert_same(&by_reference(&x, &y), &by_value(&x, &y));
}
