//! Sums of densities on the log scale.

use crate::number::scalar::Scalar;

/// Computes ln Σᵢ exp(xᵢ) of the terms xᵢ without overflow, as a single operation; −∞ if there are no terms. Use it
/// to marginalise discrete unknowns.
///
/// A term of −∞ has no effect. If the components are distributions, prefer [`Mixture`](crate::Mixture), which also
/// supports predictions and cross-validation.
///
/// # Example
/// The change point of a series of counts, marginalised:
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
        // −∞ − (−∞) is NaN, but the result is −∞ if all terms are −∞
        return S::from(if largest == f64::NEG_INFINITY { largest } else { value });
    }
    let partials = terms.iter().map(|term| (*term, (term.value() - value).exp()));
    // skip terms of zero density: their derivative can be infinite, and 0 · ∞ is NaN
    S::fuse_iter(value, partials.filter(|(_, partial)| *partial != 0.0))
}

#[cfg(test)]
#[path = "../../tests/unit/ln_sum_exp.rs"]
mod tests;
