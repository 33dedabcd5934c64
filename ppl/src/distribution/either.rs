//! One of two families over the same values.

use rand::Rng;

use super::{Count, CountMass, Distribution, Family, Interval, Numeric};
use super::{Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::terms::Terms;
use crate::transform::Support;

/// A distribution of one of two families; the components of a [`Mixture`](super::Mixture) of
/// both.
#[derive(Clone, Copy, Debug)]
pub enum Either<A, B> {
    /// Of the first family.
    First(A),
    /// Of the second family.
    Second(B),
}

/// The same expression for whichever it is.
macro_rules! either {
    ($either:expr, $inner:ident => $value:expr) => {
        match $either {
            Either::First($inner) => $value,
            Either::Second($inner) => $value,
        }
    };
}

impl<A: Family, B: Family> Family for Either<A, B> {}

impl<R, A, B> Distribution<R> for Either<A, B>
where
    R: Scalar,
    A: Distribution<R>,
    B: Distribution<R, Value = A::Value>,
{
    type Value = A::Value;

    #[inline]
    fn ln_density(&self, x: &A::Value) -> R {
        either!(self, d => d.ln_density(x))
    }

    #[inline]
    fn add_terms(&self, x: &A::Value, terms: &mut impl Terms<R>) {
        either!(self, d => d.add_terms(x, terms))
    }

    fn validate(&self) -> Result<(), DomainError> {
        either!(self, d => d.validate())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> A::Value {
        either!(self, d => d.draw(rng))
    }
}

impl<R, A, B> Numeric<R> for Either<A, B>
where
    R: Scalar,
    A: Numeric<R>,
    B: Numeric<R, Value = A::Value>,
{
    fn ln_probability(&self, interval: Interval) -> R {
        either!(self, d => d.ln_probability(interval))
    }

    fn draw_within<G: Rng + ?Sized>(&self, interval: Interval, rng: &mut G) -> A::Value {
        either!(self, d => d.draw_within(interval, rng))
    }

    fn number(x: &A::Value) -> f64 {
        A::number(x)
    }

    fn is_within(x: &A::Value, interval: &Interval) -> bool {
        A::is_within(x, interval)
    }

    fn clamp(x: A::Value, interval: &Interval) -> A::Value {
        A::clamp(x, interval)
    }
}

impl<A: Univariate, B: Univariate> Univariate for Either<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        either!(self, d => d.validate())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        either!(self, d => d.sample(rng))
    }

    fn mean(&self) -> f64 {
        either!(self, d => d.mean())
    }

    fn variance(&self) -> f64 {
        either!(self, d => d.variance())
    }

    fn cdf(&self, x: f64) -> f64 {
        either!(self, d => d.cdf(x))
    }

    fn sf(&self, x: f64) -> f64 {
        either!(self, d => d.sf(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        either!(self, d => d.quantile(p))
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        either!(self, d => d.upper_quantile(q))
    }
}

impl<R, A, B> UnivariateDensity<R> for Either<A, B>
where
    R: Scalar,
    A: UnivariateDensity<R>,
    B: UnivariateDensity<R>,
{
    fn support(&self) -> Support<R> {
        either!(self, d => d.support())
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        either!(self, d => d.ln_pdf(x))
    }

    #[inline]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        either!(self, d => d.add_ln_pdf(x, terms))
    }

    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        either!(self, d => d.at_coordinate(y, terms))
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        either!(self, d => d.ln_mass(lower, upper))
    }
}

impl<A: Count, B: Count> Count for Either<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        either!(self, d => d.validate())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        either!(self, d => d.sample(rng))
    }

    fn mean(&self) -> f64 {
        either!(self, d => d.mean())
    }

    fn variance(&self) -> f64 {
        either!(self, d => d.variance())
    }

    fn cdf(&self, k: u64) -> f64 {
        either!(self, d => d.cdf(k))
    }

    fn sf(&self, k: u64) -> f64 {
        either!(self, d => d.sf(k))
    }
}

impl<R, A, B> CountMass<R> for Either<A, B>
where
    R: Scalar,
    A: CountMass<R>,
    B: CountMass<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        either!(self, d => d.ln_pmf(k))
    }

    #[inline]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        either!(self, d => d.add_ln_pmf(k, terms))
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        either!(self, d => d.ln_mass(first, last))
    }
}
