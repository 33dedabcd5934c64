//! Censored distributions, for measurements with a detection limit or a measuring range.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::interval::Interval;
use crate::distribution::traits::Distribution;
use crate::distribution::univariate_density::{UnivariateDensity, ln_probability};
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;

/// A univariate distribution censored at the limits `lower` and `upper`; created by [`Variations::censor`](crate::Variations::censor). The
/// distribution is for observed data; it cannot be the prior of an unknown.
///
/// A datum between the limits contributes its log density. A datum at or below the lower limit contributes ln P(X ≤
/// lower), a datum at or above the upper limit ln P(X ≥ upper). This covers left censoring, right censoring and both at
/// once. A draw beyond a limit is replaced by the limit.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // a test that ends after 100 hours: a part that still works at the end has a life of more than 100 hours
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

impl<R, D> Distribution<R> for Censored<D>
where
    R: Scalar,
    D: UnivariateDensity<R> + Distribution<R, Value = R>,
{
    type Value = R;

    #[inline(always)]
    fn add_terms(&self, x: &R, terms: &mut impl Accumulator<R>) {
        let (lower, upper) = (self.interval.lower(), self.interval.upper());
        if x.value() <= lower {
            terms.add_number(ln_probability(&self.inner, Interval::new(..lower)));
        } else if x.value() >= upper {
            terms.add_number(ln_probability(&self.inner, Interval::new(upper..)));
        } else {
            self.inner.add_terms(x, terms);
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        Distribution::validate(&self.inner)?;
        self.interval.validate("censor")
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> R {
        let (x, interval) = (self.inner.draw(rng).value(), self.interval);
        // `f64::max` and `f64::min` would replace NaN by a limit
        R::from(match x {
            x if x < interval.lower() => interval.lower(),
            x if x > interval.upper() => interval.upper(),
            x => x,
        })
    }
}
