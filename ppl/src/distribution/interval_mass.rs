//! Probabilities of intervals, with their derivatives in the parameters.

use super::interval::Interval;
use super::univariate::{Univariate, masses, quantile_within};
use crate::scalar::Scalar;
use crate::transform::Support;

/// ln P(X ∈ interval) for any density whose support does not move with its parameters: its
/// derivative in a parameter is the expectation of ∂ ln p over the interval. −∞ where the probability
/// is below the smallest number.
pub(super) fn ln_mass_by_quadrature<R: Scalar>(
    distribution: &impl Univariate,
    support: Support<R>,
    interval: Interval,
    ln_pdf: impl Fn(R) -> R,
) -> R {
    let (below, inside, above) = masses(distribution, interval);
    let (a, b) = support.within(interval.lower(), interval.upper()).bounds();
    // from the tails where these are small
    let both = below < 0.5 && above < 0.5 && inside > 0.5;
    let value = if both { (-(below + above)).ln_1p() } else { inside.ln() };
    if !R::DIFFERENTIABLE || value == f64::NEG_INFINITY {
        return R::from(value);
    }
    let part = Support::Real.within(a, b);
    let at = |y: f64| {
        let (x, log_jacobian) = part.constrain(y);
        (ln_pdf(R::from(x)), log_jacobian)
    };
    // parameters that are data leave nothing to integrate; a partial may vanish at one point,
    // not at three
    if [-0.9, 0.1, 1.3].into_iter().all(|y| at(y).0.is_constant()) {
        return R::from(value);
    }
    let quartile = |u| part.unconstrain(quantile_within(distribution, interval, u, 1.0 - u));
    R::fuse_iter(value, expectation(at, [0.25, 0.5, 0.75].map(quartile)))
}

/// Terms and normalised weights whose sum is the expectation of a term given as (ln p, log
/// Jacobian) over an unconstrained coordinate y: the trapezoid rule in t with
/// y = median + spread · sinh t (double exponential quadrature; Takahasi & Mori 1974, Publ.
/// RIMS 9).
fn expectation<R: Scalar>(
    ln_pdf: impl Fn(f64) -> (R, f64),
    [first, median, third]: [f64; 3],
) -> Vec<(R, f64)> {
    const STEP: f64 = 1.0 / 12.0;
    const REACH: i32 = 54;
    let spread = (third - first).abs().max(f64::MIN_POSITIVE);
    let mut terms: Vec<(R, f64)> = (-REACH..=REACH)
        .filter_map(|i| {
            let t = f64::from(i) * STEP;
            let (term, log_jacobian) = ln_pdf(median + spread * t.sinh());
            let weight = (term.value() + log_jacobian).exp() * t.cosh();
            (weight > 0.0 && weight.is_finite()).then_some((term, weight))
        })
        .collect();
    let total: f64 = terms.iter().map(|(_, w)| w).sum();
    terms.iter_mut().for_each(|(_, w)| *w /= total);
    terms
}
