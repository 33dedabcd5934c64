//! The gamma distribution.

use rand::Rng;

use super::interval_mass::ln_mass_by_ends;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{
    HALF_LN_2PI, Tail, deviance, gamma_ln_quantile, ln_minus_digamma, regularised_gamma,
    remembered, stirling_error,
};
use crate::terms::{Joined, Terms};
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

/// ln(x p(x)) at the rate-scaled value t = β x, and its derivative in the shape where that is
/// unknown.
#[inline]
pub(super) fn ln_power<R: Scalar>(unknown_shape: R, t: f64) -> (f64, f64) {
    let shape = unknown_shape.value();
    let parts = |shape: f64| {
        let ln_shape = shape.ln();
        let constant = 0.5 * ln_shape - HALF_LN_2PI - stirling_error(shape);
        [constant, ln_minus_digamma(shape) - ln_shape]
    };
    let [constant, digamma] = remembered!(parts, shape);
    let in_shape = if unknown_shape.is_constant() { 0.0 } else { t.ln() + digamma };
    (constant - deviance(shape, t), in_shape)
}

impl<A: Parameter, B: Parameter> Gamma<A, B> {
    /// The limit of ln p at 0, where x^{α − 1} alone decides, so many times.
    #[inline]
    fn add_at_zero<R: Scalar>(&self, times: f64, terms: &mut impl Terms<R>)
    where
        B: Datum<R>,
    {
        let (shape, rate) = (self.0.number(), self.1.number());
        if shape == 1.0 {
            terms.add(times * rate.ln(), ((self.1, times / rate),));
        } else {
            terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
        }
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

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let (shape, rate, v) = (self.0.number(), self.1.number(), x.value());
        if v == 0.0 {
            return self.add_at_zero(1.0, terms);
        }
        let unknown_shape = lift::<R>(self.0);
        let (value, in_shape) = ln_power(unknown_shape, rate * v);
        terms.add(
            value - v.ln(),
            ((x, (shape - 1.0) / v - rate), (self.0, in_shape), (self.1, shape / rate - v)),
        );
    }

    const POOLS: bool = true;

    /// n, x̄, Σ ln(x̄/x) and Σ ln x of positive data, and how many zeros there are.
    fn sum_up(data: impl Iterator<Item = R>, sums: &mut Vec<f64>) {
        let (zeros, data): (Vec<_>, Vec<_>) = data.map(R::value).partition(|x| *x == 0.0);
        let n = data.len() as f64;
        let mean = data.iter().sum::<f64>() / n.max(1.0);
        let below: f64 = data.iter().map(|x| (mean / x).ln()).sum();
        let ln: f64 = data.iter().map(|x| x.ln()).sum();
        sums.extend([n, mean, below, ln, zeros.len() as f64]);
    }

    /// Σ ln(x p(x)) as n times that at x̄, less α Σ ln(x̄/x).
    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let &[n, mean, below, ln, zeros] = sums else { return };
        if zeros > 0.0 {
            self.add_at_zero(zeros, terms);
        }
        if n == 0.0 {
            return;
        }
        let (shape, rate) = (self.0.number(), self.1.number());
        let (value, in_shape) = ln_power(lift::<R>(self.0), rate * mean);
        let constant = if terms.leave_out_constants() { 0.0 } else { ln };
        terms.add(
            n * value - shape * below - constant,
            ((self.0, n * in_shape - below), (self.1, n * (shape / rate - mean))),
        );
    }

    /// The Jacobian cancels 1/x.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let (shape, rate, v) = (self.0.number(), self.1.number(), y.value().exp());
        let unknown_shape = lift::<R>(self.0);
        let (value, in_shape) = ln_power(unknown_shape, rate * v);
        terms.add(value, ((y, shape - rate * v), (self.0, in_shape), (self.1, shape / rate - v)));
        terms.replace(y, v, v)
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (shape, rate) = (self.0.number(), self.1.number());
        let still = Gamma(self.0, rate);
        ln_mass_by_ends(self, &still, [lower, upper], [lift(self.1)], |x| {
            let ln_pdf = UnivariateDensity::<f64>::ln_pdf(&Gamma(shape, rate), x);
            (ln_pdf, [-x / rate])
        })
    }
}
