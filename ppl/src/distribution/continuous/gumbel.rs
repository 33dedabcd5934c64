//! The Gumbel distribution.

use std::f64::consts::{FRAC_PI_6, PI};

use crate::density::DomainError;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{Tail, ln_one_minus_exp};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Gumbel distribution of maxima with location (and mode) μ and scale β.
///
/// ln p(x) = −ln β − z − e^{−z}, with z = (x − μ)/β and β > 0. For a minimum x, such as the strength of the weakest
/// link, −x has this distribution.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let largest = Gumbel(10.0, 2.0);
/// let density: f64 = largest.ln_density(&10.0);
/// assert!((density + 2.0f64.ln() + 1.0).abs() < 1e-15);
/// assert!((largest.cdf(10.0) - (-1.0f64).exp()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 22.
#[derive(Clone, Copy, Debug)]
pub struct Gumbel<M, S>(pub M, pub S);

/// The Euler–Mascheroni constant, the mean of the standard distribution.
const EULER: f64 = 0.577_215_664_901_532_9;

crate::univariate!([M: Parameter, S: Parameter] Gumbel<M, S>);

impl<M: Parameter, S: Parameter> Gumbel<M, S> {
    fn standardised(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

impl<M: Parameter, S: Parameter> Univariate for Gumbel<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Gumbel", "location", self.0.number())?;
        DomainError::require_positive("Gumbel", "scale", self.1.number())
    }

    fn mean(&self) -> f64 {
        self.0.number() + EULER * self.1.number()
    }

    fn variance(&self) -> f64 {
        PI * FRAC_PI_6 * self.1.number().powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        (-(-self.standardised(x)).exp()).exp()
    }

    fn sf(&self, x: f64) -> f64 {
        -(-(-self.standardised(x)).exp()).exp_m1()
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let z = self.standardised(x);
        match tail {
            Tail::Lower => -(-z).exp(),
            // ln(1 − e^{−t}) is ln t up to rounding for t = e^{−z} below 1e-17
            Tail::Upper if z > 40.0 => -z,
            Tail::Upper => ln_one_minus_exp((-z).exp()),
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * (-p.ln()).ln()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() - self.1.number() * (-(-q).ln_1p()).ln()
    }
}

impl<R, M, S> UnivariateDensity<R> for Gumbel<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = M::CONSTANT && S::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let scale = self.1.number();
        let inverse = scale.recip();
        let z = self.standardised(x.value());
        let power = (-z).exp();
        let slope = (power - 1.0) * inverse;
        // at x = −∞ the value is −∞: the finite bound avoids ∞ − ∞
        terms.add(
            -scale.ln() - z.max(f64::MIN) - power,
            ((x, slope), (self.0, -slope), (self.1, -inverse - z * slope)),
        );
    }
}
