//! The inverse gamma distribution.

use rand::Rng;

use super::gamma::{Gamma, ln_power};
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::traits::lift;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::{Tail, gamma_ln_quantile, regularised_gamma};
use crate::transform::Support;

/// Inverse gamma distribution with shape α and scale β: 1/X is Gamma(α, β).
///
/// ln p(x) = α ln β − ln Γ(α) − (α + 1) ln x − β/x, for x > 0 and α, β > 0. The mean exists for
/// α > 1, the variance for α > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let variance = InverseGamma(3.0, 4.0);
/// assert_eq!(variance.mean(), 2.0);
/// assert!((variance.cdf(2.0) - Gamma(3.0, 4.0).sf(0.5)).abs() < 1e-15);
/// ```
///
/// # References
/// Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., appendix A.
#[derive(Clone, Copy, Debug)]
pub struct InverseGamma<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] InverseGamma<A, B>);

impl<A: Parameter, B: Parameter> InverseGamma<A, B> {
    /// P(X ≤ x) and P(X > x).
    fn tails(&self, x: f64) -> (f64, f64) {
        if x <= 0.0 {
            return (0.0, 1.0);
        }
        let (above, below) = regularised_gamma(self.0.number(), self.1.number() / x);
        (below, above)
    }
}

impl<A: Parameter, B: Parameter> Univariate for InverseGamma<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("InverseGamma", "shape", self.0.number())?;
        DomainError::require_positive("InverseGamma", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        Gamma(self.0, self.1).sample(rng).recip()
    }

    fn mean(&self) -> f64 {
        let shape = self.0.number();
        if shape > 1.0 { self.1.number() / (shape - 1.0) } else { f64::INFINITY }
    }

    fn variance(&self) -> f64 {
        let shape = self.0.number();
        if shape > 2.0 {
            self.mean().powi(2) / (shape - 2.0)
        } else if shape > 1.0 {
            f64::INFINITY
        } else {
            f64::NAN
        }
    }

    fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    fn sf(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            return self.upper_quantile(1.0 - p);
        }
        self.1.number() / gamma_ln_quantile(self.0.number(), p, Tail::Upper).exp()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 {
            return self.quantile(1.0 - q);
        }
        self.1.number() * (-gamma_ln_quantile(self.0.number(), q, Tail::Lower)).exp()
    }
}

impl<R, A, B> UnivariateDensity<R> for InverseGamma<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (shape, scale, v) = (lift::<R>(self.0), self.1.number(), x.value());
        if v == 0.0 {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let inverse = v.recip();
        let t = scale * inverse;
        let (value, in_shape) = ln_power(shape, t);
        let excess = shape.value() - t;
        terms.add(
            value - v.ln(),
            ((x, -(excess + 1.0) * inverse), (shape, in_shape), (self.1, excess / scale)),
        );
    }
}
