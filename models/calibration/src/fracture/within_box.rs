//! Deviations of a positive parameter that keep the parameter in its box.

use ppl::prelude::*;

/// Returns the parameter whose logarithm is `ln` plus a deviation. The deviation is added to the logit of the
/// relative position of the logarithm in the box, so that the parameter stays between the bounds `lower` and `upper`.
/// The logit is scaled such that in the middle of the box, a small deviation changes the logarithm by the same
/// amount.
pub(super) fn deviated<R: Scalar>(ln: R, deviation: R, [lower, upper]: [f64; 2]) -> R {
    let (bottom, width) = (lower.ln(), (upper / lower).ln());
    let share = (ln - bottom) / width;
    let logit = share.ln() - (-share).ln_1p() + deviation * (4.0 / width);
    exponential_within(logit.logistic() * width + bottom, [lower, upper])
}

/// Returns the exponential of a logarithm, limited to the box: rounding errors could move the
/// exponential out of the box.
pub(super) fn exponential_within<R: Scalar>(ln: R, [lower, upper]: [f64; 2]) -> R {
    ln.exp().clamp(lower, upper)
}
