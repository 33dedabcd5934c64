//! The Cauchy distribution.

use std::f64::consts::{FRAC_1_PI, PI};

use crate::density::DomainError;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::ln_1p_square;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Cauchy distribution with location (and median) μ and scale γ, half the interquartile range. The distribution has no
/// mean.
///
/// ln p(x) = −ln π − ln γ − ln(1 + z²), with z = (x − μ)/γ and γ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let prior = Cauchy(1.0, 2.5);
/// assert!((prior.quantile(0.75) - 3.5).abs() < 1e-14);
/// let same: f64 = StudentT(1.0, 1.0, 2.5).ln_density(&4.0);
/// assert!((prior.ln_density(&4.0) - same).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 16.
#[derive(Clone, Copy, Debug)]
pub struct Cauchy<M, S>(pub M, pub S);

/// The constant ln π.
const LN_PI: f64 = 1.144_729_885_849_400_2;

crate::univariate!([M: Parameter, S: Parameter] Cauchy<M, S>);

impl<M: Parameter, S: Parameter> Cauchy<M, S> {
    fn standardised(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

impl<M: Parameter, S: Parameter> Univariate for Cauchy<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Cauchy", "location", self.0.number())?;
        DomainError::require_positive("Cauchy", "scale", self.1.number())
    }

    fn mean(&self) -> f64 {
        f64::NAN
    }

    fn variance(&self) -> f64 {
        f64::NAN
    }

    // P(X ≤ x) = ½ + arctan(z)/π is the angle of the point (−z, 1), without cancellation for z → −∞
    fn cdf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(-self.standardised(x))
    }

    fn sf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(self.standardised(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        if p > 0.5 {
            self.upper_quantile(1.0 - p)
        } else {
            self.0.number() - self.1.number() / (PI * p).tan()
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        if q > 0.5 {
            self.quantile(1.0 - q)
        } else {
            self.0.number() + self.1.number() / (PI * q).tan()
        }
    }
}

impl<R, M, S> UnivariateDensity<R> for Cauchy<M, S>
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
        let (square, slope, share) = ln_1p_square(self.standardised(x.value()));
        let in_x = -2.0 * slope * inverse;
        terms.add(
            -LN_PI - scale.ln() - square,
            ((x, in_x), (self.0, -in_x), (self.1, (2.0 * share - 1.0) * inverse)),
        );
    }
}
