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
        let size: f64 = -self.1.number() * rng.random::<f64>().ln();
        R::from(self.0.number() + if rng.random() { size } else { -size })
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Laplace", "location", self.0.number())?;
        DomainError::require_positive("Laplace", "scale", self.1.number())
    }
}

ppl::density!([M: Parameter, S: Parameter] Laplace<M, S>);
