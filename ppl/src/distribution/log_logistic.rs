//! The log-logistic distribution.

use std::f64::consts::PI;

use rand::Rng;

use super::logistic::{ln_between, standard};
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Log-logistic distribution with scale (and median) α and shape β: ln X is logistic.
///
/// ln p(x) = ln β − ln x + u − 2 ln(1 + eᵘ) with u = β ln(x/α), for x > 0 and α, β > 0. The mean
/// exists for β > 1, the variance for β > 2.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let time_s = LogLogistic(30.0, 4.0);
/// assert!((time_s.cdf(60.0) - 16.0 / 17.0).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2,
/// section 23.11.
#[derive(Clone, Copy, Debug)]
pub struct LogLogistic<A, B>(pub A, pub B);

crate::univariate!([A: Parameter, B: Parameter] LogLogistic<A, B>);

impl<A: Parameter, B: Parameter> LogLogistic<A, B> {
    fn logit(&self, x: f64) -> f64 {
        self.1.number() * (x.max(0.0) / self.0.number()).ln()
    }

    fn at_logit(&self, u: f64) -> f64 {
        self.0.number() * (u / self.1.number()).exp()
    }

    /// ln(x p(x)) at the logit u with its derivatives in ln x, α and β.
    #[inline]
    fn ln_power(&self, u: f64) -> (f64, [f64; 3]) {
        let (scale, shape) = (self.0.number(), self.1.number());
        let (value, slope) = standard(u);
        let in_log = shape * slope;
        (shape.ln() + value, [-in_log, in_log / scale, (1.0 - slope * u) / shape])
    }
}

impl<A: Parameter, B: Parameter> Univariate for LogLogistic<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("LogLogistic", "scale", self.0.number())?;
        DomainError::require_positive("LogLogistic", "shape", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        let b = PI / self.1.number();
        if b < PI { self.0.number() * b / b.sin() } else { f64::INFINITY }
    }

    fn variance(&self) -> f64 {
        let b = PI / self.1.number();
        if b >= PI {
            f64::NAN
        } else if 2.0 * b >= PI {
            f64::INFINITY
        } else {
            let first = b / b.sin();
            self.0.number().powi(2) * (2.0 * b / (2.0 * b).sin() - first * first)
        }
    }

    fn cdf(&self, x: f64) -> f64 {
        logistic(self.logit(x)).0
    }

    fn sf(&self, x: f64) -> f64 {
        logistic(self.logit(x)).1
    }

    fn quantile(&self, p: f64) -> f64 {
        self.at_logit((p / (1.0 - p)).ln())
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.at_logit(-(q / (1.0 - q)).ln())
    }
}

impl<R, A, B> UnivariateDensity<R> for LogLogistic<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
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
        let v = x.value();
        if v == 0.0 {
            // the limit: x^{β − 1} alone decides
            let (scale, shape) = (self.0.number(), self.1.number());
            if shape == 1.0 {
                return terms.add(-scale.ln(), ((self.0, -scale.recip()),));
            }
            return terms.add_number(R::from((1.0 - shape) * f64::INFINITY));
        }
        let (value, [in_log, in_scale, in_shape]) = self.ln_power(self.logit(v));
        terms
            .add(value - v.ln(), ((x, (in_log - 1.0) / v), (self.0, in_scale), (self.1, in_shape)));
    }

    /// The Jacobian cancels 1/x.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let logit = self.1.number() * (y.value() - self.0.number().ln());
        let (value, partials) = self.ln_power(logit);
        let [in_y, in_first, in_second] = partials;
        terms.add(value, ((y, in_y), (self.0, in_first), (self.1, in_second)));
        y.exp()
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let [a, b] = [lower, upper].map(|x| self.logit(x));
        let (value, [in_a, in_b]) = ln_between(a, b);
        let moved = |u: f64, slope: f64| if u.is_finite() { u * slope } else { 0.0 };
        let (scale, shape) = (self.0.number(), self.1.number());
        R::fuse(
            value,
            [lift(self.0), lift(self.1)],
            [-shape / scale * (in_a + in_b), (moved(a, in_a) + moved(b, in_b)) / shape],
        )
    }
}
