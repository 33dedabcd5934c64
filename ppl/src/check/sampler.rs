//! Samplers that simulation-based calibration can test.

use super::CheckError;
use crate::sampler::{Chains, Metropolis, Nuts};
use crate::{Bound, Model};

/// Draws from a posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Draws {
    /// Draws in unconstrained coordinates: a row-major matrix with one row per draw, `n × dim`.
    pub points: Vec<f64>,
    /// Number of divergent transitions among the draws.
    pub divergences: usize,
}

/// A sampler that can draw from the posterior of any model, for [`sbc`](super::sbc).
///
/// [`Nuts`] and [`Metropolis`] implement this trait. Implement it to test your own sampler, or a sampler with further
/// inputs, such as [`DelayedAcceptance`](crate::DelayedAcceptance) with its cheap density.
pub trait Sampler: Sync {
    /// Samples `model` with the sampler's settings and the given seed.
    ///
    /// # Errors
    /// [`CheckError`] if the sampler fails.
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError>;
}

impl Draws {
    /// Collects all draws of the given chains.
    ///
    /// # Errors
    /// [`CheckError::Stopped`] if a chain ended early.
    pub fn of_chains(chains: &Chains) -> Result<Self, CheckError> {
        match chains.chains.iter().find_map(|chain| chain.stopped.clone()) {
            Some(reason) => Err(CheckError::Stopped(reason)),
            None => Ok(Self {
                points: chains.chains.iter().flat_map(|chain| &chain.draws).copied().collect(),
                divergences: chains.divergences(),
            }),
        }
    }
}

macro_rules! impl_for_chains {
    ($($Sampler:ident)*) => {$(
        impl Sampler for $Sampler<'_> {
            fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
                Draws::of_chains(&self.clone().seed(seed).run(model)?)
            }
        }
    )*};
}
impl_for_chains!(Nuts Metropolis);
