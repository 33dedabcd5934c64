//! The logit-normal distribution.

use rand::Rng;

use super::{Normal, Parameter, Univariate, UnivariateDensity};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Logit-normal distribution on (0, 1): ln(X/(1 − X)) is normal with mean μ and standard
/// deviation σ.
///
/// ln p(x) = −½ z² − ln x − ln(1 − x) − ln σ − ½ ln 2π with z = (logit x − μ)/σ, for σ > 0. Its
/// moments have no closed form and are computed by quadrature.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let share = LogitNormal(0.0, 1.0);
/// assert_eq!(share.quantile(0.5), 0.5);
/// assert!((share.mean() - 0.5).abs() < 1e-15);
/// ```
///
/// # References
/// Atchison & Shen (1980), doi:10.2307/2335470.
#[derive(Clone, Copy, Debug)]
pub struct LogitNormal<M, S>(pub M, pub S);

crate::univariate!([M: Parameter, S: Parameter] LogitNormal<M, S>);

impl<M: Parameter, S: Parameter> LogitNormal<M, S> {
    fn logit(&self) -> Normal<M, S> {
        Normal(self.0, self.1)
    }

    /// E g(X) by the trapezoid rule, which is exact to rounding for analytic functions of a
    /// normal variable.
    fn expectation(&self, g: impl Fn(f64) -> f64) -> f64 {
        const STEP: f64 = 1.0 / 32.0;
        let (mean, sd) = (self.0.number(), self.1.number());
        let (mut total, mut weight) = (0.0, 0.0);
        for i in -288..=288 {
            let z = f64::from(i) * STEP;
            let density = (-0.5 * z * z).exp();
            total += density * g(logistic(mean + sd * z).0);
            weight += density;
        }
        total / weight
    }
}

fn logit(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    (x / (1.0 - x)).ln()
}

impl<M: Parameter, S: Parameter> Univariate for LogitNormal<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("LogitNormal", "mean of the logit", self.0.number())?;
        DomainError::require_positive("LogitNormal", "sd of the logit", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        logistic(self.logit().sample(rng)).0
    }

    fn mean(&self) -> f64 {
        self.expectation(|x| x)
    }

    fn variance(&self) -> f64 {
        let mean = self.mean();
        self.expectation(|x| (x - mean).powi(2))
    }

    fn cdf(&self, x: f64) -> f64 {
        self.logit().cdf(logit(x))
    }

    fn sf(&self, x: f64) -> f64 {
        self.logit().sf(logit(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        logistic(self.logit().quantile(p)).0
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        logistic(self.logit().upper_quantile(q)).0
    }
}

impl<R, M, S> UnivariateDensity<R> for LogitNormal<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    const NATURAL_ENDS: bool = true;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(R::from(0.0), R::from(1.0))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let v = x.value();
        let complement = 1.0 - v;
        if v == 0.0 || complement == 0.0 {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        // in the logit, with the Jacobian of the map to it
        let (ln, ln_complement) = (v.ln(), (-v).ln_1p());
        let inverse = self.1.number().recip();
        let z = (ln - ln_complement - self.0.number()) * inverse;
        let normal = -0.5 * z * z - self.1.number().ln() - crate::special::HALF_LN_2PI;
        terms.add(
            normal - ln - ln_complement,
            (
                (x, (v - complement - z * inverse) / (v * complement)),
                (self.0, z * inverse),
                (self.1, (z * z - 1.0) * inverse),
            ),
        );
    }

    /// The Jacobian cancels: in its coordinate the variable is normal.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        self.logit().add_ln_pdf(y, terms);
        y.logistic()
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        self.logit().ln_mass(logit(lower), logit(upper))
    }
}
