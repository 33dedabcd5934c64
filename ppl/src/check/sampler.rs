//! What is checked: whole samplers, and their transitions.

use rand::Rng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::CheckError;
use crate::sampler::{
    Chains, ComponentwiseMetropolis, DifferentialEvolution, Metropolis, Nuts, Smc,
};
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

/// One transition that leaves the posterior of any model unchanged, for
/// [`geweke`](super::geweke).
///
/// It must not be tuned to the point where it starts. The samplers of this crate take part without
/// warmup, so tune beforehand: give [`Nuts`] a `warm_start`, and [`DifferentialEvolution`] an
/// `archive`. The others propose with their first scale, which is about right where the prior has
/// unit scale in unconstrained coordinates.
pub trait Transition: Sync {
    /// Moves `y`, the unconstrained unknowns.
    ///
    /// # Errors
    /// [`CheckError`] if it cannot.
    fn transition<M: Model>(
        &self,
        model: &Bound<M>,
        y: &mut Vec<f64>,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<(), CheckError>;
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

        impl Transition for $Sampler<'_> {
            fn transition<M: Model>(
                &self,
                model: &Bound<M>,
                y: &mut Vec<f64>,
                rng: &mut Xoshiro256PlusPlus,
            ) -> Result<(), CheckError> {
                let one = self.clone().chains(1).warmup(0).draws(1).init_points(vec![y.clone()]);
                *y = Draws::of_chains(&one.seed(rng.random()).run(model)?)?.points;
                Ok(())
            }
        }
    )*};
}
impl_for_chains!(Nuts Metropolis ComponentwiseMetropolis DifferentialEvolution);

impl Sampler for Smc<'_> {
    fn draws<M: Model>(&self, model: &Bound<M>, seed: u64) -> Result<Draws, CheckError> {
        Draws::of_chains(&self.clone().seed(seed).run(model)?.draws)
    }
}
