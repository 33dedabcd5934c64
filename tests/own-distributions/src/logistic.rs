//! The logistic distribution, which can be truncated and censored.

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::transform::Support;
use ppl::{Accumulator, Datum, DomainError, Univariate, UnivariateDensity};

/// Logistic distribution with location μ and scale s.
///
/// ln p(x) = −|z| − 2 ln(1 + exp(−|z|)) − ln s with z = (x − μ)/s, for s > 0.
#[derive(Clone, Copy, Debug)]
pub struct Logistic<M, S>(pub M, pub S);

impl<R, M, S> ppl::Density<R> for Logistic<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    type Domain = Support<R>;

    fn domain(&self) -> Support<R> {
        Support::Real
    }

    fn ln_density(&self, x: &R) -> R {
        let (location, scale): (R, R) = (self.0.lift(), self.1.lift());
        // the density is symmetric, and exp(−|z|) does not overflow
        let distance = (*x - location).abs() / scale;
        -distance - (-distance).exp().ln_1p() * 2.0 - scale.ln()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> R {
        R::from(self.sample(rng))
    }
}

/// Distribution functions, which only `.truncate` and `.censor` need. They have no derivatives.
impl<M: Parameter, S: Parameter> Univariate for Logistic<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Logistic", "location", self.0.number())?;
        DomainError::require_positive("Logistic", "scale", self.1.number())
    }

    fn cdf(&self, x: f64) -> f64 {
        1.0 / (1.0 + ((self.0.number() - x) / self.1.number()).exp())
    }

    fn sf(&self, x: f64) -> f64 {
        1.0 / (1.0 + ((x - self.0.number()) / self.1.number()).exp())
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() + self.1.number() * (p.ln() - (-p).ln_1p())
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() - self.1.number() * (q.ln() - (-q).ln_1p())
    }
}

/// Support and density, both taken from [`ppl::Density`]: `add_number` derives the partial derivatives.
impl<R, M, S> UnivariateDensity<R> for Logistic<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    fn support(&self) -> Support<R> {
        ppl::Density::<R>::domain(self)
    }

    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        terms.add_number(ppl::Density::ln_density(self, &x));
    }
}

// in place of `density!`
ppl::univariate!([M: Parameter, S: Parameter] Logistic<M, S>);
