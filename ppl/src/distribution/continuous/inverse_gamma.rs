//! The inverse gamma distribution.

use rand::Rng;

use super::gamma::{Gamma, ln_power};
use crate::density::DomainError;
use crate::distribution::traits::lift;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::Tail;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Inverse gamma distribution with shape α and scale β: 1/x has the distribution `Gamma(α, β)`.
///
/// ln p(x) = α ln β − ln Γ(α) − (α + 1) ln x − β/x, for x > 0 and α, β > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let variance = InverseGamma(3.0, 4.0);
/// assert_eq!(variance.mean(), 2.0);
/// let of_precision: f64 = Gamma(3.0, 4.0).ln_density(&0.5);
/// assert!((variance.ln_density(&2.0) - (of_precision - 2.0 * 2.0f64.ln())).abs() < 1e-14);
/// ```
///
/// # References
/// Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., appendix A.
#[derive(Clone, Copy, Debug)]
pub struct InverseGamma<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] InverseGamma<A, B>);

impl<A: Parameter, B: Parameter> InverseGamma<A, B> {
    /// Distribution of 1/x.
    fn inverse(&self) -> Gamma<f64, f64> {
        Gamma(self.0.number(), self.1.number())
    }
}

impl<A: Parameter, B: Parameter> Univariate for InverseGamma<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("InverseGamma", "shape", self.0.number())?;
        DomainError::require_positive("InverseGamma", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.inverse().sample(rng).recip()
    }

    fn mean(&self) -> f64 {
        let shape = self.0.number();
        if shape > 1.0 { self.1.number() / (shape - 1.0) } else { f64::INFINITY }
    }

    fn variance(&self) -> f64 {
        let shape = self.0.number();
        if shape > 2.0 { self.mean().powi(2) / (shape - 2.0) } else { f64::INFINITY }
    }

    fn cdf(&self, x: f64) -> f64 {
        // the inverse of −∞ is −0, so that numbers that are not positive need their own branch; NaN stays NaN
        if x <= 0.0 { 0.0 } else { self.inverse().sf(x.recip()) }
    }

    fn sf(&self, x: f64) -> f64 {
        if x <= 0.0 { 1.0 } else { self.inverse().cdf(x.recip()) }
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        if x <= 0.0 {
            return if tail == Tail::Lower { f64::NEG_INFINITY } else { 0.0 };
        }
        let opposite = if tail == Tail::Lower { Tail::Upper } else { Tail::Lower };
        self.inverse().ln_tail(x.recip(), opposite)
    }

    fn quantile(&self, p: f64) -> f64 {
        self.inverse().upper_quantile(p).recip()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.inverse().quantile(q).recip()
    }
}

impl<R, A, B> UnivariateDensity<R> for InverseGamma<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    const CONSTANT: bool = A::CONSTANT && B::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (shape, scale, v) = (self.0.number(), self.1.number(), x.value());
        if v == 0.0 {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let inverse = v.recip();
        let (value, in_shape) = ln_power(lift::<R>(self.0), scale * inverse);
        terms.add(
            value - v.ln(),
            (
                (x, (scale * inverse - shape - 1.0) * inverse),
                (self.0, in_shape),
                (self.1, shape / scale - inverse),
            ),
        );
    }

    /// The Jacobian x cancels the factor 1/x of the density.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let (shape, scale, v) = (self.0.number(), self.1.number(), y.value().exp());
        let inverse = (-y.value()).exp();
        let (value, in_shape) = ln_power(lift::<R>(self.0), scale * inverse);
        terms.add(
            value,
            ((y, scale * inverse - shape), (self.0, in_shape), (self.1, shape / scale - inverse)),
        );
        terms.replace(y, v, v)
    }
}
