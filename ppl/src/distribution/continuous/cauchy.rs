//! The Cauchy distribution.

use std::f64::consts::{FRAC_1_PI, PI};

use rand::Rng;

use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::interval::Interval;
use crate::distribution::interval_mass::ln_mass_by_ends;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::ln_1p_square;
use crate::transform::Support;

/// Cauchy distribution with location (and median) μ and scale σ; it has no mean.
///
/// ln p(x) = −ln π − ln σ − ln(1 + ((x − μ)/σ)²), for σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let peak = Cauchy(1.0, 2.0);
/// assert!((peak.cdf(3.0) - 0.75).abs() < 1e-15);
/// assert!(peak.mean().is_nan());
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 16.
#[derive(Clone, Copy, Debug)]
pub struct Cauchy<M, S>(pub M, pub S);

const LN_PI: f64 = 1.144_729_885_849_400_2;

crate::univariate!([M: Parameter, S: Parameter] Cauchy<M, S>);

impl<M: Parameter, S: Parameter> Cauchy<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

/// The z with P(Z > z) = q.
fn upper(q: f64) -> f64 {
    if (0.25..0.75).contains(&q) { (PI * (0.5 - q)).tan() } else { (PI * q).tan().recip() }
}

impl<M: Parameter, S: Parameter> Univariate for Cauchy<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Cauchy", "location", self.0.number())?;
        DomainError::require_positive("Cauchy", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.upper_quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        f64::NAN
    }

    fn variance(&self) -> f64 {
        f64::NAN
    }

    fn cdf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(-self.standardise(x))
    }

    fn sf(&self, x: f64) -> f64 {
        FRAC_1_PI * 1f64.atan2(self.standardise(x))
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * upper(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() + self.1.number() * upper(q)
    }
}

impl<R, M, S> UnivariateDensity<R> for Cauchy<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let scale = self.1.number();
        let inverse = scale.recip();
        let (square, slope, share) = ln_1p_square(self.standardise(x.value()));
        let in_x = -2.0 * slope * inverse;
        terms.add(
            -LN_PI - scale.ln() - square,
            ((x, in_x), (self.0, -in_x), (self.1, (2.0 * share - 1.0) * inverse)),
        );
    }
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let numbers = (self.0.number(), self.1.number());
        let ln_pdf = |x| UnivariateDensity::<f64>::ln_pdf(&Cauchy(numbers.0, numbers.1), x);
        let interval = Interval::new(lower..upper);
        let (value, in_location, in_scale) = ln_mass_by_ends(self, interval, numbers, ln_pdf);
        R::gather(value, ((self.0, in_location), (self.1, in_scale)))
    }
}
