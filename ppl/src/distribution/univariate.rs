//! Distributions of one real number, as plain numbers.

use rand::Rng;

use super::family::Family;
use super::interval::Interval;
use crate::density::DomainError;
use crate::special::{LnProbability, LnTails, Tail};

/// A distribution of one real number: what needs the values of its parameters only.
pub trait Univariate: Family {
    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw.
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64;

    /// Expectation; NaN or infinite where it does not exist.
    fn mean(&self) -> f64;

    /// Variance; NaN or infinite where it does not exist.
    fn variance(&self) -> f64;

    /// P(X ≤ x), accurate in the lower tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_cdf`](super::UnivariateDensity::ln_cdf) has them).
    fn cdf(&self, x: f64) -> f64;

    /// P(X > x), accurate in the upper tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_sf`](super::UnivariateDensity::ln_sf) has them).
    fn sf(&self, x: f64) -> f64;

    /// ln P(X ≤ x) or ln P(X > x), a plain number.
    ///
    /// The default is the logarithm of [`cdf`](Univariate::cdf) or [`sf`](Univariate::sf). Override it
    /// where a probability below the smallest number, 1e-308, matters: draws from a truncation that far
    /// out need it.
    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        match tail {
            Tail::Lower => self.cdf(x).ln(),
            Tail::Upper => self.sf(x).ln(),
        }
    }

    /// The x with P(X ≤ x) = p.
    fn quantile(&self, p: f64) -> f64;

    /// The x with P(X > x) = q, accurate for small q.
    fn upper_quantile(&self, q: f64) -> f64 {
        self.quantile(1.0 - q)
    }
}

/// P(X ≤ lower), P(lower < X < upper) and P(X ≥ upper).
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

/// Below this a probability, or a share of it, may have lost digits by underflow.
pub(super) const NEAR_UNDERFLOW: f64 = 1e-290;

/// ln P(X ∈ interval), and the share of the larger tail that a difference of two tails has left.
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
    // from the tails where these are small
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

/// The x in the interval with the shares `below` and `above` = 1 − below of its mass on either
/// side, from the end that keeps digits.
pub(super) fn quantile_within(
    distribution: &impl Univariate,
    interval: Interval,
    below: f64,
    above: f64,
) -> f64 {
    let (lower, upper) = (interval.lower(), interval.upper());
    // bounds out of order hold no value, and `clamp` would panic
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

/// [`quantile_within`] an interval whose probability underflows, by bisection over the ordered
/// numbers of 64 bits.
fn far_quantile(distribution: &impl Univariate, interval: Interval, below: f64, above: f64) -> f64 {
    let (lower, upper) = (interval.lower(), interval.upper());
    if below <= 0.0 {
        return lower;
    }
    if above <= 0.0 {
        return upper;
    }
    let ln_tail = |x: f64, tail: Tail| distribution.ln_tail(x, tail);
    // the smaller tail has the digits
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
        // the lower tail grows with x, the upper one falls
        if if is_lower { reached >= target } else { reached <= target } {
            last = middle;
        } else {
            first = middle + 1;
        }
    }
    from_order(first).clamp(lower, upper)
}

/// The place of a number among all of 64 bits, infinities by the largest finite ones.
fn to_order(x: f64) -> i128 {
    let bits = x.clamp(-f64::MAX, f64::MAX).to_bits();
    let size = i128::from(bits & (u64::MAX >> 1));
    if x.is_sign_negative() { -size } else { size }
}

/// The inverse of [`to_order`].
fn from_order(order: i128) -> f64 {
    let size = f64::from_bits(order.unsigned_abs() as u64);
    if order < 0 { -size } else { size }
}
