//! Mixtures of real numbers: moments, probabilities and quantiles.

use rand::Rng;

use super::Mixture;
use crate::accumulator::{Accumulator, Joined};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::interval::Interval;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::{UnivariateDensity, add_terms, ln_probability};
use crate::distribution::vector::Sequence;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::transform::Support;

impl<W: Sequence<Item: Parameter>, C: Sequence<Item: Univariate>> Mixture<W, C> {
    /// The x where an increasing function of it crosses zero, by bisection to the last digit.
    fn bisect(&self, quantile: impl Fn(&C::Item) -> f64, f: impl Fn(f64) -> f64) -> f64 {
        let ends = self.pairs().filter(|(weight, _)| weight.number() > 0.0);
        let (mut low, mut high) = ends
            .map(|(_, component)| quantile(component))
            .fold((f64::NAN, f64::NAN), |ends, x| (ends.0.min(x), ends.1.max(x)));
        while low < high && low.is_finite() && high.is_finite() {
            let middle = low + 0.5 * (high - low);
            if middle <= low || middle >= high {
                break;
            }
            if f(middle) < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        // an infinite end is where a quantile of probability 0 or 1 lies
        if low.is_finite() { high } else { low }
    }
}

impl<W: Sequence<Item: Parameter>, C: Sequence<Item: Univariate>> Univariate for Mixture<W, C> {
    fn validate(&self) -> Result<(), DomainError> {
        self.require_weights()?;
        self.components().try_for_each(|component| component.validate())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.choose(rng).sample(rng)
    }

    fn mean(&self) -> f64 {
        self.average(Univariate::mean)
    }

    fn variance(&self) -> f64 {
        let mean = self.mean();
        self.average(|component| component.variance() + (component.mean() - mean).powi(2))
    }

    fn cdf(&self, x: f64) -> f64 {
        self.average(|component| component.cdf(x))
    }

    fn sf(&self, x: f64) -> f64 {
        self.average(|component| component.sf(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        self.bisect(|component| component.quantile(p), |x| self.cdf(x) - p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.bisect(|component| component.upper_quantile(q), |x| q - self.sf(x))
    }
}

impl<R, W, C> UnivariateDensity<R> for Mixture<W, C>
where
    R: Scalar,
    W: Sequence<Item: Parameter + Datum<R>>,
    C: Sequence<Item: UnivariateDensity<R>>,
{
    const NATURAL_ENDS: bool = <C::Item as UnivariateDensity<R>>::NATURAL_ENDS;

    /// The smallest interval that holds the supports of all components.
    fn support(&self) -> Support<R> {
        let supports = self.components().map(|component| component.support());
        supports.reduce(|hull, own| hull.hull(own)).unwrap_or(Support::Real)
    }

    #[inline]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let ln_density = |component: &C::Item| Joined::of(|terms| add_terms(component, x, terms));
        terms.add_number(self.ln_average(ln_density));
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let interval = Interval::new(lower..upper);
        self.ln_average(|component| ln_probability(component, interval))
    }
}
