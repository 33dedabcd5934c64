//! Logarithms of sums, compared with closed forms, and sums with terms of zero density.

use super::*;
use crate::number::dual::Dual;

/// Checks ln(2 + 3 + 5) and its weights, for small and for very large terms.
#[test]
fn weights_are_shares() {
    for shift in [0.0, 1e4, -1e4] {
        let terms = Dual::variables([2.0f64, 3.0, 5.0].map(|x| x.ln() + shift));
        let sum = ln_sum_exp(&terms);
        approx::assert_relative_eq!(sum.value(), 10f64.ln() + shift, max_relative = 1e-15);
        for (got, share) in sum.gradient().into_iter().zip([0.2, 0.3, 0.5]) {
            approx::assert_relative_eq!(got, share, max_relative = 1e-11);
        }
    }
}

#[test]
fn what_is_impossible_adds_nothing() {
    let none = f64::NEG_INFINITY;
    assert_eq!(ln_sum_exp(&[none, 0.25]), 0.25);
    assert_eq!(ln_sum_exp::<f64>(&[]), none);
    assert_eq!(ln_sum_exp(&[none, none]), none);
    assert!(ln_sum_exp(&[0.0, f64::NAN]).is_nan());
    assert!(!ln_sum_exp(&[f64::INFINITY, 0.0]).is_finite());
    let [x] = Dual::variables([1.0]);
    assert_eq!(ln_sum_exp(&[Dual::from(none), x]).gradient(), [1.0]);
}
