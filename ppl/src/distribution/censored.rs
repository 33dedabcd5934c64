//! Measurements that stop at a limit.

use rand::Rng;

use super::{Distribution, Family, Interval, Numeric};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::terms::Terms;

/// A distribution observed through an instrument that ends at `lower` and `upper`; made by
/// [`Family::censor`]. It can be observed, not declared.
///
/// A datum inside contributes its density, one at or below the lower end ln P(X ≤ lower), one at
/// or above the upper end ln P(X ≥ upper): left and right censoring, or both at once. Draws
/// beyond an end are recorded at it.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // a test that ends after 100 hours: whatever still runs has lived longer
/// let life_h = Exponential(0.01).censor(..100.0);
/// let broke: f64 = life_h.ln_density(&40.0);
/// let survived: f64 = life_h.ln_density(&100.0);
/// assert!((broke - (0.01f64.ln() - 0.4)).abs() < 1e-14);
/// assert!((survived + 1.0).abs() < 1e-14);
/// ```
///
/// # References
/// Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., section 8.7.
#[derive(Clone, Copy, Debug)]
pub struct Censored<D> {
    pub(super) inner: D,
    pub(super) interval: Interval,
}

impl<D: Family> Family for Censored<D> {}

impl<D> Censored<D> {
    /// Whether the instrument shows `x` as it is.
    #[inline]
    fn shows<R: Scalar>(&self, x: &D::Value) -> bool
    where
        D: Numeric<R>,
    {
        let number = D::number(x);
        number > self.interval.lower() && number < self.interval.upper()
    }
}

impl<R: Scalar, D: Numeric<R>> Distribution<R> for Censored<D> {
    type Value = D::Value;

    #[inline]
    fn ln_density(&self, x: &D::Value) -> R {
        let number = D::number(x);
        if number <= self.interval.lower() {
            self.inner.ln_probability(Interval::new(..=self.interval.lower()))
        } else if number >= self.interval.upper() {
            self.inner.ln_probability(Interval::new(self.interval.upper()..))
        } else {
            self.inner.ln_density(x)
        }
    }

    #[inline(always)]
    fn add_terms(&self, x: &D::Value, terms: &mut impl Terms<R>) {
        if self.shows(x) {
            self.inner.add_terms(x, terms);
        } else {
            terms.add_number(self.ln_density(x));
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()?;
        self.interval.validate("censor")
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> D::Value {
        D::clamp(self.inner.draw(rng), &self.interval)
    }
}
