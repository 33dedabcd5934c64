//! Sums of densities.

use crate::scalar::Scalar;

/// ln Σ eˣⁱ without overflow, as one operation: what sums a discrete unknown out. −∞ for no terms.
///
/// A term of −∞ changes nothing. Where the components are distributions, [`Mixture`](crate::Mixture)
/// says the same, and can be predicted and left out.
///
/// # Example
/// The change point of a series of counts, summed out:
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn change(counts: &[u64]) {
///         let early ~ Exponential(1.0);
///         let late ~ Exponential(1.0);
///         let mut paths = Vec::new();
///         for change in 0..counts.len() {
///             let mut path = 0.0;
///             for (t, k) in counts.iter().enumerate() {
///                 path += Poisson(if t < change { early } else { late }).ln_density(k);
///             }
///             paths.push(path);
///         }
///         factor(ln_sum_exp(&paths));
///     }
/// }
/// ppl::check::gradient(&change(&[4, 5, 3, 0, 1, 0]), 1);
/// ```
///
/// # References
/// Blanchard, Higham & Higham (2021), doi:10.1093/imanum/draa038.
#[doc(alias = "log_sum_exp")]
#[doc(alias = "logsumexp")]
pub fn ln_sum_exp<S: Scalar>(terms: &[S]) -> S {
    let largest = terms.iter().map(|term| term.value()).fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = terms.iter().map(|term| (term.value() - largest).exp()).sum();
    let value = largest + sum.ln();
    if !value.is_finite() {
        // −∞ − (−∞) is no number, though a sum of nothing is
        return S::from(if largest == f64::NEG_INFINITY { largest } else { value });
    }
    S::fuse_iter(value, terms.iter().map(|term| (*term, (term.value() - value).exp())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    /// ln(2 + 3 + 5) and its weights, however large the terms.
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
}
