//! Probabilities of intervals, with their derivatives in the parameters.

use super::{Interval, Truncated, Univariate, UnivariateDensity};
use crate::scalar::Scalar;
use crate::special::{ln_one_minus_exp, nodes_from_zero};
use crate::transform::Support;

/// ln P(X ∈ interval), also where the interval covers the support or misses it.
pub fn ln_probability<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    interval: Interval,
) -> R {
    let (lower, upper) = (interval.lower(), interval.upper());
    let (a, b) = distribution.support().bounds();
    if lower <= a && upper >= b {
        R::from(0.0)
    } else if lower >= b || upper <= a || lower >= upper {
        R::from(f64::NEG_INFINITY)
    } else {
        distribution.ln_mass(lower, upper)
    }
}

/// The same for ends that may be unknowns: each adds or takes away the density where it moves.
pub(super) fn ln_mass_between<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    lower: R,
    upper: R,
) -> R {
    let ends = [lower, upper];
    let mass = ln_probability(distribution, Interval::new(lower.value()..upper.value()));
    if ends.into_iter().all(R::is_constant) {
        return mass;
    }
    let (a, b) = distribution.support().bounds();
    let density = |x: f64| {
        // an end that is nowhere near the support takes nothing away when it moves
        if !(a < x && x < b) {
            return 0.0;
        }
        (distribution.ln_pdf(R::from(x)).value() - mass.value()).exp()
    };
    let [below, above] = ends.map(|end| density(end.value()));
    R::fuse(mass.value(), [mass, lower, upper], [1.0, -below, above])
}

/// Below this a probability is taken from the density, since both tails round to 0 or 1.
const SMALLEST: f64 = 1e-280;

/// ln P(lower < X < upper) for any density whose support does not move with its parameters:
/// its derivative in a parameter is the expectation of ∂ ln p over the interval.
pub(super) fn ln_mass_by_quadrature<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    lower: f64,
    upper: f64,
) -> R {
    let interval = within(distribution, lower, upper);
    by_quadrature(&interval, interval.masses())
}

fn within<D: Univariate>(distribution: &D, lower: f64, upper: f64) -> Truncated<D> {
    Truncated { inner: distribution.clone(), interval: Interval::new(lower..upper) }
}

/// The same, with what is known of P(X < lower), P(lower < X < upper) and P(X > upper).
fn by_quadrature<R: Scalar, D: UnivariateDensity<R>>(
    interval: &Truncated<D>,
    (below, inside, above): (f64, f64, f64),
) -> R {
    let distribution = &interval.inner;
    let (a, b) = interval.support().bounds();
    if inside < SMALLEST && a < b {
        return if below > 0.5 { far_out(distribution, a, b) } else { far_out(distribution, b, a) };
    }
    let value = if below < 0.5 && above < 0.5 && inside > 0.5 {
        (-(below + above)).ln_1p()
    } else {
        inside.ln()
    };
    if !R::DIFFERENTIABLE {
        return R::from(value);
    }
    let support = Support::Real.within(a, b);
    let ln_pdf = |y: f64| {
        let (x, log_jacobian) = support.constrain(y);
        (distribution.ln_pdf(R::from(x)), log_jacobian)
    };
    // parameters that are data leave nothing to integrate; a partial may vanish at one point,
    // not at three
    if [-0.9, 0.1, 1.3].into_iter().all(|y| ln_pdf(y).0.is_constant()) {
        return R::from(value);
    }
    let quartiles = [0.25, 0.5, 0.75].map(|u| support.unconstrain(interval.quantile(u)));
    R::fuse_iter(value, expectation(ln_pdf, quartiles))
}

/// Below this share of both tails the difference of the densities at two ends has lost its digits.
const NARROW: f64 = 1e-3;

/// ln P(lower < X < upper) where it is known how some parameters, `moving`, shift the quantiles, as
/// locations, scales and rates do: `at` has ln p(x) and the derivatives of a quantile x in them.
///
/// ∂P is p(lower) times what they shift the quantile there by, less the same at the upper end; only
/// what is unknown of `still`, the distribution with their plain numbers, is left to quadrature.
pub(super) fn ln_mass_by_ends<R, D, E, const K: usize>(
    distribution: &D,
    still: &E,
    [lower, upper]: [f64; 2],
    moving: [R; K],
    at: impl Fn(f64) -> (f64, [f64; K]),
) -> R
where
    R: Scalar,
    D: UnivariateDensity<R>,
    E: UnivariateDensity<R>,
{
    let interval = within(still, lower, upper);
    let masses = interval.masses();
    let (below, inside, above) = masses;
    if inside < SMALLEST || inside < NARROW * below.min(above) {
        return by_quadrature(&within(distribution, lower, upper), masses);
    }
    let mass = by_quadrature(&interval, masses);
    if !R::DIFFERENTIABLE {
        return mass;
    }
    let (a, b) = still.support().bounds();
    // at infinity, or outside the support, no quantile is shifted across an end
    let moved = |x: f64| {
        if !(a < x && x < b) {
            return [0.0; K];
        }
        let (ln_pdf, velocities) = at(x);
        let density = (ln_pdf - mass.value()).exp();
        velocities.map(|v| density * v)
    };
    let (low, high) = (moved(lower), moved(upper));
    let partials = moving.into_iter().zip((0..K).map(|k| low[k] - high[k]));
    R::fuse_iter(mass.value(), partials.chain([(mass, 1.0)]))
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

/// The same where the whole interval lies so far out that its probability underflows: the
/// density is integrated relative to its value at the `near` end, from which it decays.
fn far_out<R: Scalar, D: UnivariateDensity<R>>(distribution: &D, near: f64, far: f64) -> R {
    let direction = (far - near).signum();
    let at = |distance: f64| distribution.ln_pdf(R::from(near + direction * distance));
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

/// ln(e^{−G} − e^{−H}) for G ≤ H, functions of K parameters with these partials: the mass of an
/// interval where one tail of the distribution is e^{−H}, H its cumulative hazard.
///
/// −G + ln(1 − e^{−(H − G)}) has no cancellation, however far out.
#[inline]
pub(super) fn ln_mass_by_hazard<R: Scalar, const K: usize>(
    parameters: [R; K],
    (less, in_less): (f64, [f64; K]),
    (more, in_more): (f64, [f64; K]),
) -> R {
    let between = more - less;
    // the tails relative to the mass
    let inner = -(-between).exp_m1().recip();
    let outer = between.exp_m1().recip();
    let partials = std::array::from_fn(|k| {
        // an end at infinity, or outside the support, does not move: 0 · ∞
        let far = if outer == 0.0 { 0.0 } else { outer * in_more[k] };
        let near = if less == 0.0 { 0.0 } else { inner * in_less[k] };
        far - near
    });
    R::fuse(ln_one_minus_exp(between) - less, parameters, partials)
}

/// The logarithms of both tails at an end of an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct LnTails {
    pub(super) below: f64,
    pub(super) above: f64,
}

impl LnTails {
    /// ln P(lower < X < upper), from the tails that are small.
    pub(super) fn between(lower: Self, upper: Self) -> f64 {
        const LN_HALF: f64 = -std::f64::consts::LN_2;
        if lower.above < LN_HALF {
            lower.above + ln_one_minus_exp(lower.above - upper.above)
        } else if upper.below < LN_HALF {
            upper.below + ln_one_minus_exp(upper.below - lower.below)
        } else {
            (-(lower.below.exp() + upper.above.exp())).ln_1p()
        }
    }
}

/// The mass of an interval of z = (x − location)/scale with its derivatives, from the tails and
/// the log density of z.
pub(super) fn ln_mass_by_tails<R: Scalar>(
    [location, scale]: [R; 2],
    [lower, upper]: [f64; 2],
    tails: impl Fn(f64) -> LnTails,
    ln_pdf: impl Fn(f64) -> f64,
) -> R {
    let inverse = scale.value().recip();
    let [a, b] = [lower, upper].map(|x| (x - location.value()) * inverse);
    let value = LnTails::between(tails(a), tails(b));
    let ends = [a, b].map(|z| {
        let relative = if z.is_finite() { (ln_pdf(z) - value).exp() } else { 0.0 };
        (relative, if relative == 0.0 { 0.0 } else { z * relative })
    });
    R::fuse(
        value,
        [location, scale],
        [(ends[0].0 - ends[1].0) * inverse, (ends[0].1 - ends[1].1) * inverse],
    )
}
