//! Univariate distributions: values without derivatives.

use rand::Rng;

use super::family::Family;
use super::interval::Interval;
use crate::density::DomainError;
use crate::special::{LnProbability, LnTails, Tail, integral_from_zero};

/// A univariate distribution: methods that need only the values of its parameters.
pub trait Univariate: Family {
    /// Checks that the parameters are valid.
    ///
    /// # Errors
    /// [`DomainError`] with distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// Draws exactly from the distribution. The default is the quantile of a uniform number.
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    /// Mean; NaN or infinite if the mean does not exist. The default integrates the distribution functions; override
    /// this method if the mean does not exist.
    fn mean(&self) -> f64 {
        let (up, down) = sides(self, 1);
        self.quantile(0.5) + (up - down)
    }

    /// Variance; NaN or infinite if the variance does not exist. The default integrates the distribution functions;
    /// override this method if the variance does not exist.
    fn variance(&self) -> f64 {
        let ((up, down), (up_square, down_square)) = (sides(self, 1), sides(self, 2));
        up_square + down_square - (up - down).powi(2)
    }

    /// Distribution function P(X ≤ x), accurate in the lower tail. The result has no derivatives with respect to
    /// unknown parameters; for derivatives, use [`ln_cdf`](super::UnivariateDensity::ln_cdf).
    fn cdf(&self, x: f64) -> f64;

    /// Survival function P(X > x), accurate in the upper tail. The result has no derivatives with respect to unknown
    /// parameters; for derivatives, use [`ln_sf`](super::UnivariateDensity::ln_sf).
    fn sf(&self, x: f64) -> f64;

    /// Log tail probability ln P(X ≤ x) or ln P(X > x), without derivatives.
    ///
    /// The default is the logarithm of [`cdf`](Univariate::cdf) or [`sf`](Univariate::sf). Override this method if
    /// probabilities below the smallest positive number, 1e-308, must be supported: they occur in draws from a
    /// distribution that is truncated very far out in the tail.
    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        match tail {
            Tail::Lower => self.cdf(x).ln(),
            Tail::Upper => self.sf(x).ln(),
        }
    }

    /// Quantile x with P(X ≤ x) = p.
    fn quantile(&self, p: f64) -> f64;

    /// Upper quantile x with P(X > x) = q, accurate for small q.
    fn upper_quantile(&self, q: f64) -> f64 {
        self.quantile(1.0 - q)
    }
}

/// Contributions of X > c and of X < c to the moment E|X − c|ⁿ about the median c: n ∫ tⁿ⁻¹ P(X > c + t) dt and n ∫ tⁿ⁻¹
/// P(X < c − t) dt. These integrals follow from integration by parts and need only distribution functions.
pub(super) fn sides(distribution: &impl Univariate, n: i32) -> (f64, f64) {
    let centre = distribution.quantile(0.5);
    let scale = distribution.quantile(0.75) - distribution.quantile(0.25);
    let weight = |d: f64| f64::from(n) * d.powi(n - 1);
    let length = distribution.upper_quantile(0.0) - centre;
    let up = integral_from_zero(|d| weight(d) * distribution.sf(centre + d), length, scale);
    let length = centre - distribution.quantile(0.0);
    let down = integral_from_zero(|d| weight(d) * distribution.cdf(centre - d), length, scale);
    (up, down)
}

/// Probabilities below, inside and above an interval: P(X ≤ lower), P(lower < X < upper) and P(X ≥ upper).
pub(super) fn masses(distribution: &impl Univariate, interval: Interval) -> (f64, f64, f64) {
    let (lower, upper) = (interval.lower(), interval.upper());
    let (below, above) = (distribution.cdf(lower), distribution.sf(upper));
    let inside = if below > 0.5 {
        distribution.sf(lower) - above
    } else if above > 0.5 {
        distribution.cdf(upper) - below
    } else {
        1.0 - below - above
    };
    (below, inside, above)
}

/// Probability below which the result of a distribution function can be inaccurate because of underflow.
pub(super) const NEAR_UNDERFLOW: f64 = 1e-290;

/// Returns the log probability ln P(X ∈ interval), and a measure of cancellation: the interval's probability is the
/// difference of two tail probabilities, and the measure is the ratio of this difference to the larger tail
/// probability.
pub(super) fn ln_inside(distribution: &impl Univariate, interval: Interval) -> (f64, f64) {
    let (below, inside, above) = masses(distribution, interval);
    if inside < NEAR_UNDERFLOW && below + above > 0.5 {
        let [lower, upper] = [interval.lower(), interval.upper()].map(|x| {
            let ln = |tail| LnProbability { ln: distribution.ln_tail(x, tail), slopes: [] };
            LnTails::<0> { lower: ln(Tail::Lower), upper: ln(Tail::Upper) }
        });
        let (mass, share) = LnTails::between(&lower, &upper);
        return (mass.ln, share);
    }
    // compute 1 − P(interval) from the two tails if both tails are small
    let both = below < 0.5 && above < 0.5 && inside > 0.5;
    let value = if both { (-(below + above)).ln_1p() } else { inside.ln() };
    let share = if below > 0.5 {
        inside / (inside + above)
    } else if above > 0.5 {
        inside / (inside + below)
    } else {
        inside
    };
    (value, share)
}

/// Quantile within an interval: the point that divides the interval's probability into the fractions `below` and
/// `above` = 1 − `below`. The quantile is computed from the tail that is more accurate.
pub(super) fn quantile_within(
    distribution: &impl Univariate,
    interval: Interval,
    below: f64,
    above: f64,
) -> f64 {
    let (lower, upper) = (interval.lower(), interval.upper());
    // reversed bounds have no quantile, and `clamp` would panic
    if lower.is_nan() || upper.is_nan() || lower > upper {
        return f64::NAN;
    }
    let (outside_below, inside, outside_above) = masses(distribution, interval);
    if inside < NEAR_UNDERFLOW && outside_below + outside_above > 0.5 {
        return far_quantile(distribution, interval, below, above);
    }
    let p = outside_below + below * inside;
    let x = if p < 0.5 {
        distribution.quantile(p)
    } else {
        distribution.upper_quantile(outside_above + above * inside)
    };
    x.clamp(lower, upper)
}

/// Version of [`quantile_within`] for an interval whose probability underflows, by bisection over all `f64` numbers.
fn far_quantile(distribution: &impl Univariate, interval: Interval, below: f64, above: f64) -> f64 {
    let (lower, upper) = (interval.lower(), interval.upper());
    if below <= 0.0 {
        return lower;
    }
    if above <= 0.0 {
        return upper;
    }
    let ln_tail = |x: f64, tail: Tail| distribution.ln_tail(x, tail);
    // the smaller tail is more accurate
    let is_lower = ln_tail(upper, Tail::Lower) < ln_tail(lower, Tail::Upper);
    let (tail, near, far, share, rest) = match is_lower {
        true => (Tail::Lower, upper, lower, below, above),
        false => (Tail::Upper, lower, upper, above, below),
    };
    let whole = ln_tail(near, tail);
    if !whole.is_finite() {
        return f64::NAN;
    }
    let target = whole + (share + rest * (ln_tail(far, tail) - whole).exp()).ln();
    let (mut first, mut last) = (to_order(lower), to_order(upper));
    while first < last {
        let middle = first + (last - first) / 2;
        let reached = ln_tail(from_order(middle), tail);
        // the lower tail is an increasing function of x, and the upper tail is a decreasing
        // function of x
        if if is_lower { reached >= target } else { reached <= target } {
            last = middle;
        } else {
            first = middle + 1;
        }
    }
    from_order(first).clamp(lower, upper)
}

/// Returns the rank of a number in the ordered set of all `f64` numbers; ±∞ have the ranks of the finite numbers of
/// largest magnitude.
fn to_order(x: f64) -> i128 {
    let bits = x.clamp(-f64::MAX, f64::MAX).to_bits();
    let size = i128::from(bits & (u64::MAX >> 1));
    if x.is_sign_negative() { -size } else { size }
}

/// Inverse of [`to_order`].
fn from_order(order: i128) -> f64 {
    let size = f64::from_bits(order.unsigned_abs() as u64);
    if order < 0 { -size } else { size }
}
