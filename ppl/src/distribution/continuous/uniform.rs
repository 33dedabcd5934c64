//! The continuous uniform distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::traits::lift;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::ln_ratio;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;
use crate::transform::log_logistic_density;

/// Uniform distribution on (a, b).
///
/// ln p(x) = −ln(b − a), for a < b.
///
/// The unconstrained coordinate of an unknown with this prior has the standard logistic distribution, because the width
/// cancels between density and Jacobian.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let young = Uniform(250.0, 300.0);
/// assert_eq!(young.mean(), 275.0);
/// assert_eq!(young.ln_density(&260.0), -(50f64.ln()));
/// assert_eq!(young.ln_density(&310.0), f64::NEG_INFINITY);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 26.
#[derive(Clone, Copy, Debug)]
pub struct Uniform<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] Uniform<A, B>);

impl<A: Parameter, B: Parameter> Uniform<A, B> {
    fn width(&self) -> f64 {
        self.1.number() - self.0.number()
    }
}

impl<A: Parameter, B: Parameter> Univariate for Uniform<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        let (a, b) = (self.0.number(), self.1.number());
        DomainError::require_finite("Uniform", "lower end", a)?;
        DomainError::require_finite("Uniform", "upper end", b)?;
        DomainError::require(
            a < b,
            "Uniform",
            "lower end",
            format_args!("below the upper end {b}"),
            a,
        )
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let u: f64 = rng.random();
        self.0.number() + self.width() * u
    }

    fn mean(&self) -> f64 {
        0.5 * (self.0.number() + self.1.number())
    }

    fn variance(&self) -> f64 {
        self.width().powi(2) / 12.0
    }

    fn cdf(&self, x: f64) -> f64 {
        ((x - self.0.number()) / self.width()).clamp(0.0, 1.0)
    }

    fn sf(&self, x: f64) -> f64 {
        ((self.1.number() - x) / self.width()).clamp(0.0, 1.0)
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() + self.width() * p
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.1.number() - self.width() * q
    }
}

impl<R, A, B> UnivariateDensity<R> for Uniform<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    const CONSTANT: bool = A::CONSTANT && B::CONSTANT;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Between(lift(self.0), lift(self.1))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let width = self.width();
        // NaN if x is NaN
        let value = 0.0 * x.value() - width.ln();
        terms.add(value, ((self.0, width.recip()), (self.1, -width.recip())));
    }

    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let support: Support<R> = self.support();
        let (value, slope) = log_logistic_density(y.value(), |x| terms.minus_ln(x));
        terms.add(value, ((y, slope),));
        support.replace(y, terms)
    }

    /// The parameter derivatives take into account that the interval is clipped to (a, b).
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (a, b, width) = (self.0.number(), self.1.number(), self.width());
        let (low, high) = (a.max(lower), b.min(upper));
        let inside = (high - low).recip();
        let (own_low, own_high) = (f64::from(a > lower), f64::from(b < upper));
        R::gather(
            ln_ratio(high - low, width),
            (
                (self.0, width.recip() - own_low * inside),
                (self.1, own_high * inside - width.recip()),
            ),
        )
    }
}
