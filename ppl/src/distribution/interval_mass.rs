//! Probabilities of intervals, with their derivatives in the parameters.

use super::interval::Interval;
use super::univariate::{Univariate, ln_inside, quantile_within};
use crate::scalar::Scalar;
use crate::special::{Node, density_nodes};
use crate::transform::Support;

/// Share of the larger tail below which a difference of two tails has lost too many digits.
pub(super) const CANCELLED: f64 = 0.05;

/// ln P(X ∈ interval) for any density, by adaptive quadrature over the distribution's own unconstrained
/// coordinate y.
///
/// Its derivative in a parameter is the mean over the interval of ∂ ln p(y), and what flows over an end
/// that moves in y: −p(u) ∂x(y)/∂θ at the upper end u, and the opposite at the lower one. The value comes
/// from the distribution functions where these have its digits, and from the quadrature elsewhere.
pub(super) fn ln_mass_by_quadrature<R: Scalar>(
    distribution: &impl Univariate,
    support: Support<R>,
    interval: Interval,
    ln_pdf: impl Fn(R) -> R,
    ln_density_at_coordinate: impl Fn(R) -> R,
) -> R {
    let (value, share) = ln_inside(distribution, interval);
    let has_digits = share >= CANCELLED && value > f64::NEG_INFINITY;
    if has_digits && !R::DIFFERENTIABLE {
        return R::from(value);
    }
    let (first, last) = support.bounds();
    let (has_lower, has_upper) = (interval.lower() > first, interval.upper() < last);
    // a narrow interval has its digits in x, every other in the coordinate
    let is_narrow = share < CANCELLED && has_lower && has_upper;
    // the coordinate of what lies below an end runs against x
    let is_reversed = matches!(support, Support::Below(_)) && !is_narrow;
    let [lower, upper] = if is_narrow {
        [interval.lower(), interval.upper()]
    } else {
        let low = has_lower.then(|| support.unconstrain(interval.lower()));
        let high = has_upper.then(|| support.unconstrain(interval.upper()));
        let (first, last) = if is_reversed { (high, low) } else { (low, high) };
        [first.unwrap_or(f64::NEG_INFINITY), last.unwrap_or(f64::INFINITY)]
    };
    let at = |y: f64| match is_narrow {
        true => ln_pdf(R::from(y)),
        false => ln_density_at_coordinate(R::from(y)),
    };
    // parameters that are data leave nothing to integrate; a partial may vanish at one point, not at
    // three
    let part = Support::Real.within(lower, upper);
    let is_constant =
        || [-0.9, 0.1, 1.3].into_iter().all(|y| at(part.constrain(y).0).is_constant());
    if has_digits && is_constant() {
        return R::from(value);
    }
    let quartiles = || {
        let quantile = |u| quantile_within(distribution, interval, u, 1.0 - u);
        [0.25, 0.5, 0.75].map(|u| support.unconstrain(quantile(u)))
    };
    let (middle, scales) = match is_narrow {
        true => (lower, [upper - lower; 2]),
        false => place(quartiles(), [lower, upper], &|y| at(y).value()),
    };
    // evaluated once: every evaluation leaves its mark on a tape
    let mut terms = Vec::new();
    let mut ln_density = |y: f64| {
        terms.push(at(y));
        terms[terms.len() - 1].value()
    };
    let nodes = density_nodes(&mut ln_density, [lower, upper], middle, scales);
    let largest = nodes.iter().map(|node| node.ln_weight).fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return R::from(value);
    }
    let weight = |node: &Node| (node.ln_weight - largest).exp();
    let sum: f64 = nodes.iter().map(weight).sum();
    let value = if has_digits { value } else { largest + sum.ln() };
    if !R::DIFFERENTIABLE {
        return R::from(value);
    }
    let means = nodes.iter().map(|node| (terms[node.evaluation], weight(node) / sum));
    let inflow = if is_reversed { -1.0 } else { 1.0 };
    let ends = [(lower, inflow), (upper, -inflow)].into_iter();
    let flows = ends.filter(|(y, _)| y.is_finite() && !is_narrow).map(|(y, sign)| {
        let (x, ln_slope) = support.constrain(R::from(y));
        (x, sign * (at(y).value() - ln_slope.value() - value).exp())
    });
    R::fuse_iter(value, means.chain(flows))
}

/// Where the mass within an interval lies in the coordinate, and first guesses of its widths below and
/// above: from the quartiles, or from an end where these have no digits.
fn place(
    [first, median, third]: [f64; 3],
    [lower, upper]: [f64; 2],
    ln_density: &dyn Fn(f64) -> f64,
) -> (f64, [f64; 2]) {
    let is_inside = |y: f64| y.is_finite() && lower < y && y < upper;
    if is_inside(median) {
        let width = |y: f64| if is_inside(y) && y != median { (y - median).abs() } else { 1.0 };
        return (median, [width(first), width(third)]);
    }
    let middle = match (lower.is_finite(), upper.is_finite()) {
        (true, true) if ln_density(lower) >= ln_density(upper) => lower,
        (true, false) => lower,
        (_, true) => upper,
        (false, false) => 0.0,
    };
    (middle, [1.0; 2])
}
