//! The Laplace distribution.

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::transform::Support;
use ppl::{Datum, DomainError};

/// Laplace distribution with location μ and scale b.
///
/// ln p(x) = −|x − μ|/b − ln 2b, for b > 0.
#[derive(Clone, Copy, Debug)]
pub struct Laplace<M, S>(pub M, pub S);

impl<R, M, S> ppl::Density<R> for Laplace<M, S>
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
        -(*x - location).abs() / scale - (scale * 2.0).ln()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> R {
        R::from(self.quantile(rng.random()))
    }
}

// `.truncate` and `.censor` need distribution functions; without them, leave out `with tails` and this implementation
ppl::density!([M: Parameter, S: Parameter] Laplace<M, S>, with tails);

impl<M: Parameter, S: Parameter> Univariate for Laplace<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Laplace", "location", self.0.number())?;
        DomainError::require_positive("Laplace", "scale", self.1.number())
    }

    fn cdf(&self, x: f64) -> f64 {
        let z = (x - self.0.number()) / self.1.number();
        if z < 0.0 { 0.5 * z.exp() } else { 1.0 - 0.5 * (-z).exp() }
    }

    fn sf(&self, x: f64) -> f64 {
        let z = (x - self.0.number()) / self.1.number();
        if z > 0.0 { 0.5 * (-z).exp() } else { 1.0 - 0.5 * z.exp() }
    }

    fn quantile(&self, p: f64) -> f64 {
        let z = if p < 0.5 { (2.0 * p).ln() } else { -(2.0 * (1.0 - p)).ln() };
        self.0.number() + self.1.number() * z
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        2.0 * self.0.number() - self.quantile(q)
    }
}
