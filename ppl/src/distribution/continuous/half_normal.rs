//! The half-normal distribution.

use std::f64::consts::{LN_2, PI};

use rand::Rng;

use super::normal::standard_normal;
use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{
    HALF_LN_2PI, NormalInterval, Tail, half_normal_quantile, ln_normal_cdf, normal_cdf,
    normal_from_zero, normal_upper_quantile,
};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Half-normal distribution: distribution of σ |Z| for a standard normal Z.
///
/// ln p(x) = ½ ln(2/π) − ln σ − ½ (x/σ)², for x ≥ 0 and σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let scale = HalfNormal(2.0);
/// assert!((scale.mean() - 2.0 * (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-15);
/// assert_eq!(scale.ln_density(&-1.0), f64::NEG_INFINITY);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 13.
#[derive(Clone, Copy, Debug)]
pub struct HalfNormal<S>(pub S);

crate::univariate!([S: Parameter] HalfNormal<S>);

impl<S: Parameter> Univariate for HalfNormal<S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("HalfNormal", "sd", self.0.number())
    }

    fn sample<G: Rng + ?Sized>(&self, mut rng: &mut G) -> f64 {
        self.0.number() * standard_normal(&mut rng).abs()
    }

    fn mean(&self) -> f64 {
        self.0.number() * (2.0 / PI).sqrt()
    }

    fn variance(&self) -> f64 {
        self.0.number().powi(2) * (1.0 - 2.0 / PI)
    }

    fn cdf(&self, x: f64) -> f64 {
        2.0 * normal_from_zero(x.max(0.0) / self.0.number())
    }

    fn sf(&self, x: f64) -> f64 {
        2.0 * normal_cdf(-x.max(0.0) / self.0.number())
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        match tail {
            Tail::Lower => self.cdf(x).ln(),
            Tail::Upper => LN_2 + ln_normal_cdf(-x.max(0.0) / self.0.number()).0,
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() * half_normal_quantile(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 {
            self.quantile(1.0 - q)
        } else {
            self.0.number() * normal_upper_quantile(0.5 * q)
        }
    }
}

/// Negative log density at the mode, −ln p(0).
fn ln_mode_inverse(sd: f64) -> f64 {
    sd.ln() + HALF_LN_2PI - LN_2
}

impl<R, S> UnivariateDensity<R> for HalfNormal<S>
where
    R: Scalar,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = S::CONSTANT;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let sd = self.0.number();
        let z = x.value() / sd;
        terms.add(
            -0.5 * z * z - normaliser(terms, self.0, ln_mode_inverse),
            ((x, -z / sd), (self.0, (z * z - 1.0) / sd)),
        );
    }

    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let x = y.value().exp();
        let sd = self.0.number();
        let z = x / sd;
        terms.add(
            -0.5 * z * z - normaliser(terms, self.0, ln_mode_inverse) + y.value(),
            ((y, 1.0 - z * z), (self.0, (z * z - 1.0) / sd)),
        );
        terms.replace(y, x, x)
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let sd = self.0.number();
        let inside = NormalInterval::new(lower.max(0.0) / sd, upper / sd);
        R::gather(LN_2 + inside.ln_mass, ((self.0, inside.second / sd),))
    }
}
