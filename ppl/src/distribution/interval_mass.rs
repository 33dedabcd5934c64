//! Log probabilities of intervals, with their derivatives with respect to the parameters.

use super::interval::Interval;
use super::univariate::{Univariate, ln_inside, quantile_within};
use crate::number::scalar::Scalar;
use crate::special::{Node, density_nodes};
use crate::transform::Support;

/// Smallest ratio of the difference of two tail probabilities to the larger tail probability at which the difference
/// is accurate.
pub(super) const CANCELLED: f64 = 0.05;

/// Log probability ln P(X ∈ interval) of any density, by adaptive quadrature over the unconstrained coordinate y.
///
/// The derivative with respect to a parameter θ has two parts. The first is the mean of ∂ ln p(y)/∂θ over the
/// interval. The second comes from the ends of the interval, whose coordinates y depend on θ if the support depends
/// on θ: −p(u) ∂x(y)/∂θ at the upper end u, and the same expression with the opposite sign at the lower end. The
/// value is computed from the distribution functions if they are accurate, otherwise by the quadrature.
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
    // to avoid rounding errors, integrate over x if the interval is narrow, and otherwise over the unconstrained
    // coordinate y
    let is_narrow = share < CANCELLED && has_lower && has_upper;
    // for a support with only an upper bound, y is a decreasing function of x
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
    // if all parameters are data, there is no derivative to integrate; three points are tested, because a partial
    // derivative can vanish at one point
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
        false => centre_and_widths(quartiles(), [lower, upper], &|y| at(y).value()),
    };
    // evaluate each point once, because every evaluation adds operations to the tape
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
    let mut partials: Vec<(R, f64)> =
        nodes.iter().map(|node| (terms[node.evaluation], weight(node) / sum)).collect();
    let inflow = if is_reversed { -1.0 } else { 1.0 };
    for (y, sign) in [(lower, inflow), (upper, -inflow)] {
        if y.is_finite() && !is_narrow {
            let (x, ln_slope) = support.constrain(R::from(y));
            partials.push((x, sign * (at(y).value() - ln_slope.value() - value).exp()));
        }
    }
    R::fuse_iter(value, partials)
}

/// Centre of the probability mass in the unconstrained coordinate, and first estimates of its widths below and above
/// the centre. Centre and widths are computed from the quartiles. If the median is not inside the interval, the
/// centre is an end of the interval, or 0 if the interval is unbounded, and the widths are 1.
fn centre_and_widths(
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
