//! Probabilities of intervals, with their derivatives in the parameters.

use super::interval::Interval;
use super::univariate::{Univariate, masses, quantile_within};
use crate::scalar::Scalar;
use crate::special::nodes_from_zero;
use crate::transform::Support;

/// Below this a probability is taken from the density, since both tails round to 0 or 1.
const SMALLEST: f64 = 1e-280;

/// ln P(X ∈ interval) for any density whose support does not move with its parameters: its
/// derivative in a parameter is the expectation of ∂ ln p over the interval.
pub(super) fn ln_mass_by_quadrature<R: Scalar>(
    distribution: &impl Univariate,
    support: Support<R>,
    interval: Interval,
    ln_pdf: impl Fn(R) -> R,
) -> R {
    let (below, inside, above) = masses(distribution, interval);
    let (a, b) = support.within(interval.lower(), interval.upper()).bounds();
    if inside < SMALLEST && a < b {
        return if below > 0.5 { far_out(ln_pdf, a, b) } else { far_out(ln_pdf, b, a) };
    }
    let value = ln_inside((below, inside, above));
    if !R::DIFFERENTIABLE {
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

/// From the tails where these are small.
fn ln_inside((below, inside, above): (f64, f64, f64)) -> f64 {
    let both = below < 0.5 && above < 0.5 && inside > 0.5;
    if both { (-(below + above)).ln_1p() } else { inside.ln() }
}

/// ln P(X ∈ interval), and its derivatives in location and scale, of a family that these move and
/// stretch: each end takes the density there with it. For tails too heavy for quadrature.
pub(super) fn ln_mass_by_ends(
    distribution: &impl Univariate,
    interval: Interval,
    (location, scale): (f64, f64),
    ln_pdf: impl Fn(f64) -> f64,
) -> (f64, f64, f64) {
    let value = ln_inside(masses(distribution, interval));
    let [lower, upper] = [interval.lower(), interval.upper()].map(|x| {
        let density = if x.is_finite() { (ln_pdf(x) - value).exp() } else { 0.0 };
        (density, if density == 0.0 { 0.0 } else { (x - location) / scale * density })
    });
    (value, lower.0 - upper.0, lower.1 - upper.1)
}

/// Accumulator and normalised weights whose sum is the expectation of a term given as (ln p, log
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

/// The same where the whole interval lies so far out that its probability underflows: the
/// density is integrated relative to its value at the `near` end, from which it decays.
fn far_out<R: Scalar>(ln_pdf: impl Fn(R) -> R, near: f64, far: f64) -> R {
    let direction = (far - near).signum();
    let at = |distance: f64| ln_pdf(R::from(near + direction * distance));
    let peak = at(0.0).value();
    let length = (far - near).abs();
    // the distance over which ln p falls by 1, twice corrected
    let mut scale = (1e-6 * near.abs()).min(0.1 * length);
    for _ in 0..3 {
        scale /= peak - at(scale).value();
    }
    let mut terms: Vec<(R, f64)> = nodes_from_zero(length, scale)
        .map(|(distance, weight)| {
            let term = at(distance);
            (term, weight * (term.value() - peak).exp())
        })
        .filter(|(_, weight)| *weight > 0.0)
        .collect();
    let total: f64 = terms.iter().map(|(_, w)| w).sum();
    terms.iter_mut().for_each(|(_, w)| *w /= total);
    R::fuse_iter(peak + total.ln(), terms)
}
