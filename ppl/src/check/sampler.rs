//! What is calibrated: samplers.

use super::CheckError;
use crate::sampler::{Chains, Metropolis, Nuts};
use crate::{Bound, Model};

/// Draws from a posterior.
#[derive(Clone, Debug, PartialEq)]
pub struct Draws {
    /// Row-major `n × dim`, in unconstrained coordinates.
    pub points: Vec<f64>,
    /// Divergent transitions among them.
    pub divergences: usize,
}

/// Something that draws from the posterior of any model, for [`sbc`](super::sbc).
///
/// The samplers of this crate do; implement it to check an own one, or one that needs more than
/// the model, as [`DelayedAcceptance`](crate::DelayedAcceptance) its cheap density.
pub trait Sampler: Sync {
    /// Samples `model` with its settings and this seed.
    ///
    /// # Errors
    /// [`CheckError`] if it cannot.
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError>;
}

impl Draws {
    /// All draws of these chains.
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
