//! The Gaussian random walk.

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::transform::Support;
use ppl::{Datum, DomainError};

/// Gaussian random walk of a given length that begins at 0: the first value and all steps are normal with standard
/// deviation σ.
///
/// ln p(x) = Σᵢ ln Normal(xᵢ − xᵢ₋₁; 0, σ) with x₋₁ = 0, for σ > 0.
#[derive(Clone, Copy, Debug)]
pub struct RandomWalk<S> {
    /// Number of values.
    pub length: usize,
    /// Standard deviation σ of a step.
    pub step_sd: S,
}

impl<R: Scalar, S: Parameter + Datum<R>> ppl::Density<R> for RandomWalk<S> {
    type Domain = Vec<Support<R>>;

    fn domain(&self) -> Vec<Support<R>> {
        vec![Support::Real; self.length]
    }

    fn ln_density(&self, x: &Vec<R>) -> R {
        let (mut total, mut before) = (R::from(0.0), R::from(0.0));
        for x in x {
            let step: R = Normal(0.0, self.step_sd).ln_density(&(*x - before));
            total += step;
            before = *x;
        }
        total
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        let step = Normal(0.0, self.step_sd.number());
        let mut at = 0.0;
        let mut next = || {
            at += step.sample(rng);
            R::from(at)
        };
        (0..self.length).map(|_| next()).collect()
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("RandomWalk", "step_sd", self.step_sd.number())
    }
}

ppl::density!([S: Parameter] RandomWalk<S>);
