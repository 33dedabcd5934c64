//! Distributions of one real number, as plain numbers.

use rand::Rng;

use super::family::Family;
use super::interval::Interval;
use crate::density::DomainError;

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

/// The x in the interval with the shares `below` and `above` = 1 − below of its mass on either
/// side, from the end that keeps digits.
pub(super) fn quantile_within(
    distribution: &impl Univariate,
    interval: Interval,
    below: f64,
    above: f64,
) -> f64 {
    let (outside_below, inside, outside_above) = masses(distribution, interval);
    let p = outside_below + below * inside;
    let x = if p < 0.5 {
        distribution.quantile(p)
    } else {
        distribution.upper_quantile(outside_above + above * inside)
    };
    let (lower, upper) = (interval.lower(), interval.upper());
    // bounds out of order hold no value, and `clamp` would panic
    if lower <= upper { x.clamp(lower, upper) } else { f64::NAN }
}
