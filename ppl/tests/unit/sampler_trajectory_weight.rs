//! Weights of states, compared with sums of logarithms.

use super::*;

/// Logarithm of the sum, and fraction of the last weight, computed from logarithms.
fn reference(errors: &[f64]) -> (f64, f64) {
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let sum = |errors: &[f64]| errors.iter().map(|e| (least - e).exp()).sum::<f64>();
    let last = errors.len() - 1;
    (sum(errors).ln() - least, sum(&errors[last..]) / sum(errors))
}

#[test]
fn sums_and_shares_are_those_of_logarithms() {
    let errors = [0.0, 0.3, -2.0, 599.0, 601.0, -601.0, -599.5, 5e4, -5e4, -5e4 - 1.0, 990.0];
    for i in 0..errors.len() {
        for j in i + 1..=errors.len() {
            let errors = &errors[i..j];
            let mut sum = (Weight::NONE, 1.0);
            for error in errors {
                sum = sum.0.join(Weight::from_error(*error));
            }
            let (ln, fraction) = reference(errors);
            let ln_sum = sum.0.sum.ln() + sum.0.unit;
            approx::assert_relative_eq!(ln_sum, ln, max_relative = 1e-14, epsilon = 1e-13);
            approx::assert_relative_eq!(sum.1, fraction, max_relative = 1e-11);
        }
    }
}

#[test]
fn acceptances_are_at_most_one() {
    for (error, expected) in [(0.5, (-0.5f64).exp()), (-0.5, 1.0), (-700.0, 1.0), (900.0, 0.0)] {
        assert_eq!(Weight::from_error(error).acceptance(), expected);
    }
}
