//! The log-normal distribution.

use rand::Rng;

use super::normal::Normal;
use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{HALF_LN_2PI, Tail};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Log-normal distribution: ln X is normal with mean μ and standard deviation σ.
///
/// ln p(x) = −½ ((ln x − μ)/σ)² − ln x − ln σ − ½ ln 2π, for x > 0 and σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let young = LogNormal(275f64.ln(), 0.1);
/// assert!((young.quantile(0.5) - 275.0).abs() < 1e-10);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 14.
#[derive(Clone, Copy, Debug)]
pub struct LogNormal<M, S>(pub M, pub S);

crate::univariate!([M: Parameter, S: Parameter] LogNormal<M, S>);

impl<M: Parameter, S: Parameter> LogNormal<M, S> {
    fn logarithm(&self) -> Normal<M, S> {
        Normal(self.0, self.1)
    }
}

impl<M: Parameter, S: Parameter> Univariate for LogNormal<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("LogNormal", "mean of the logarithm", self.0.number())?;
        DomainError::require_positive("LogNormal", "sd of the logarithm", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.logarithm().sample(rng).exp()
    }

    fn mean(&self) -> f64 {
        (self.0.number() + 0.5 * self.1.number().powi(2)).exp()
    }

    fn variance(&self) -> f64 {
        self.1.number().powi(2).exp_m1() * self.mean().powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        self.logarithm().cdf(x.max(0.0).ln())
    }

    fn sf(&self, x: f64) -> f64 {
        self.logarithm().sf(x.max(0.0).ln())
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        self.logarithm().ln_tail(x.max(0.0).ln(), tail)
    }

    fn quantile(&self, p: f64) -> f64 {
        self.logarithm().quantile(p).exp()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.logarithm().upper_quantile(q).exp()
    }
}

impl<R, M, S> UnivariateDensity<R> for LogNormal<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = M::CONSTANT && S::CONSTANT;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Above(R::from(0.0))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let v = x.value();
        if v == 0.0 {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let sd = self.1.number();
        let z = (v.ln() - self.0.number()) / sd;
        terms.add(
            -0.5 * z * z - v.ln() - normaliser(terms, self.1, |sd| sd.ln() + HALF_LN_2PI),
            ((x, -(1.0 + z / sd) / v), (self.0, z / sd), (self.1, (z * z - 1.0) / sd)),
        );
    }

    /// The Jacobian x cancels the factor 1/x of the density: the coordinate ln x has a normal distribution.
    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        self.logarithm().add_ln_pdf(y, terms);
        let x = y.value().exp();
        terms.replace(y, x, x)
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        self.logarithm().ln_mass(lower.max(0.0).ln(), upper.max(0.0).ln())
    }
}
