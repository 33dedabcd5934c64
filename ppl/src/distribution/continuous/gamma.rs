//! The gamma distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::interval_mass::CANCELLED;
use crate::distribution::traits::lift;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{
    HALF_LN_2PI, LnTails, Tail, deviance, gamma_ln_quantile, ln_gamma_tails, ln_minus_digamma,
    memoised, regularised_gamma, stirling_error,
};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Gamma distribution with shape α and rate β (mean α/β).
///
/// ln p(x) = α ln β − ln Γ(α) + (α − 1) ln x − β x, for x > 0 and α, β > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let exponential = Gamma(1.0, 0.5);
/// assert!((exponential.ln_density(&3.0) - Exponential(0.5).ln_density(&3.0)).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 17.
#[derive(Clone, Copy, Debug)]
pub struct Gamma<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] Gamma<A, B>);

/// Returns ln(x p(x)) at the scaled value t = β x, and the derivative of ln(x p(x)) with respect to the shape. The
/// derivative is 0 if the shape is constant.
#[inline]
pub(super) fn ln_power<R: Scalar>(unknown_shape: R, t: f64) -> (f64, f64) {
    let shape = unknown_shape.value();
    let terms_of_shape = |shape: f64| {
        let ln_shape = shape.ln();
        let constant = 0.5 * ln_shape - HALF_LN_2PI - stirling_error(shape);
        [constant, ln_minus_digamma(shape) - ln_shape]
    };
    let [constant, digamma] = memoised!(terms_of_shape, shape);
    let in_shape = if unknown_shape.is_constant() { 0.0 } else { t.ln() + digamma };
    (constant - deviance(shape, t), in_shape)
}

impl<A: Parameter, B: Parameter> Gamma<A, B> {
    /// Returns the logarithms of P(X ≤ x) and P(X > x), with their derivatives with respect to the shape.
    fn tails(&self, x: f64) -> LnTails<1> {
        let (shape, rate) = (self.0.number(), self.1.number());
        if x <= 0.0 {
            return LnTails::BELOW;
        }
        let t = rate * x;
        let ln_t = if t.is_normal() { t.ln() } else { rate.ln() + x.ln() };
        ln_gamma_tails(shape, t, ln_t)
    }
}

impl<A: Parameter, B: Parameter> Univariate for Gamma<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Gamma", "shape", self.0.number())?;
        DomainError::require_positive("Gamma", "rate", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        rand_distr::Gamma::new(self.0.number(), self.1.number().recip())
            .map_or(f64::NAN, |gamma| rng.sample(gamma))
    }

    fn mean(&self) -> f64 {
        self.0.number() / self.1.number()
    }

    fn variance(&self) -> f64 {
        self.0.number() / self.1.number().powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        regularised_gamma(self.0.number(), x * self.1.number()).0
    }

    fn sf(&self, x: f64) -> f64 {
        regularised_gamma(self.0.number(), x * self.1.number()).1
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        self.tails(x).tail(tail).ln
    }

    fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            self.upper_quantile(1.0 - p)
        } else {
            gamma_ln_quantile(self.0.number(), p, Tail::Lower).exp() / self.1.number()
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 {
            self.quantile(1.0 - q)
        } else {
            gamma_ln_quantile(self.0.number(), q, Tail::Upper).exp() / self.1.number()
        }
    }
}

impl<R, A, B> UnivariateDensity<R> for Gamma<A, B>
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
        let (shape, rate, v) = (self.0.number(), self.1.number(), x.value());
        if v == 0.0 {
            // limit of ln p at x = 0, which depends on the factor x^{α − 1}
            if shape == 1.0 {
                return terms.add(rate.ln(), ((self.1, rate.recip()),));
            }
            return terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
        }
        let unknown_shape = lift::<R>(self.0);
        let (value, in_shape) = ln_power(unknown_shape, rate * v);
        terms.add(
            value - v.ln(),
            ((x, (shape - 1.0) / v - rate), (self.0, in_shape), (self.1, shape / rate - v)),
        );
    }

    /// Uses the series and the continued fraction of the incomplete gamma function, and their derivatives with
    /// respect to the shape. The derivative with respect to the rate follows from the derivatives with respect to
    /// both ends of the interval.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [below, above] = [lower, upper].map(|x| self.tails(x));
        let (mass, share) = LnTails::between(&below, &above);
        if share < CANCELLED {
            return self.ln_mass_by_quadrature(lower, upper);
        }
        if mass.ln == f64::NEG_INFINITY {
            return R::from(mass.ln);
        }
        let (shape, rate) = (self.0.number(), self.1.number());
        // x p(x)/P at both ends, where P is the probability of the interval
        let [near, far] = [lower, upper].map(|x| match x > 0.0 && x < f64::INFINITY {
            true => (ln_power(shape, rate * x).0 - mass.ln).exp(),
            false => 0.0,
        });
        R::gather(mass.ln, ((self.0, mass.slopes[0]), (self.1, (far - near) / rate)))
    }

    /// The Jacobian x cancels the factor 1/x of the density.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let (shape, rate, v) = (self.0.number(), self.1.number(), y.value().exp());
        let unknown_shape = lift::<R>(self.0);
        let (value, in_shape) = ln_power(unknown_shape, rate * v);
        terms.add(value, ((y, shape - rate * v), (self.0, in_shape), (self.1, shape / rate - v)));
        terms.replace(y, v, v)
    }
}
