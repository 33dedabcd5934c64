//! Censored distributions, for measurements with a detection limit or a measuring range.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::{Censored, Family};
use crate::distribution::interval::Interval;
use crate::distribution::traits::Distribution;
use crate::distribution::univariate_density::{UnivariateDensity, ln_probability};
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;

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
