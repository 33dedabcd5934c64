//! What a sampler leaves behind: draws, and what is needed to go on from them.

use std::collections::BTreeMap;

use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::{
    encoding::locations,
    report::{Divergence, DrawStats, WarmupReport},
    stop::StopReason,
    tuning::Tuning,
};
use crate::density::Location;

/// One chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chain {
    /// Kept draws, row-major `n × dim`, unconstrained.
    pub draws: Vec<f64>,
    /// Statistics of the kept draws, length `n`.
    pub stats: Vec<DrawStats>,
    /// Divergences among the kept draws.
    pub divergences: Vec<Divergence>,
    /// The tuning.
    pub warmup: WarmupReport,
    /// Points rejected after the warmup, by their place in the model.
    #[serde(with = "locations")]
    pub rejections: BTreeMap<Location, u64>,
    /// Why the chain ended early; `None` if it finished.
    pub stopped: Option<StopReason>,
    /// The random stream after the warmup and each kept draw, from which a chain goes on; `None` for
    /// one that failed in its warmup.
    pub(super) stream: Option<Xoshiro256PlusPlus>,
    /// Where an interrupt found the chain in its warmup.
    #[serde(default)]
    pub(super) paused: Option<Box<Paused>>,
    /// How it goes on from there, or draws where the report of the warmup does not say it.
    #[serde(default)]
    pub(super) tuning: Option<Box<Tuning>>,
}

/// A chain between two transitions of its warmup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Paused {
    pub(super) position: Vec<f64>,
    pub(super) stream: Xoshiro256PlusPlus,
    /// Transitions that the warmup has in all.
    pub(super) length: usize,
}

impl Paused {
    /// Whether it is of `dim` coordinates, after so many transitions.
    pub(super) fn fits(&self, dim: usize, transitions: usize) -> bool {
        let possible = transitions..=u32::MAX as usize;
        self.position.len() == dim && possible.contains(&self.length)
    }
}

impl Chain {
    /// Without draws.
    pub(crate) fn new(warmup: WarmupReport) -> Self {
        Self {
            draws: Vec::new(),
            stats: Vec::new(),
            divergences: Vec::new(),
            warmup,
            rejections: BTreeMap::new(),
            stopped: None,
            stream: None,
            paused: None,
            tuning: None,
        }
    }

    /// Number of kept draws.
    pub fn len(&self) -> usize {
        self.stats.len()
    }

    /// No draw was kept.
    pub fn is_empty(&self) -> bool {
        self.stats.is_empty()
    }
}

/// The chains of one run.
///
/// An interrupted run has chains of unequal length; [`Chains::len`] is the common length. The
/// [`resume`](super::Mcmc::resume) of their sampler goes on where they stand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chains {
    /// Number of unconstrained coordinates.
    pub dim: usize,
    /// The chains in the order of their random streams.
    pub chains: Vec<Chain>,
    /// Bound on the doublings of a trajectory; `None` for Metropolis.
    pub max_depth: Option<u32>,
    /// Transitions after the warmup for every kept draw.
    #[serde(default = "every")]
    pub thin: usize,
}

/// Not thinned.
fn every() -> usize {
    1
}

impl Chains {
    /// Of a run.
    pub(crate) fn new(dim: usize, chains: Vec<Chain>, thin: usize) -> Self {
        Self { dim, chains, max_depth: None, thin }
    }

    /// Number of draws that every chain has.
    pub fn len(&self) -> usize {
        self.chains.iter().map(Chain::len).min().unwrap_or(0)
    }

    /// There is no draw that every chain has.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Evaluations of the density in all chains, warmup included; of the expensive one for
    /// [`DelayedAcceptance`](crate::DelayedAcceptance).
    pub fn evaluations(&self) -> u64 {
        let of = |stats: &[DrawStats]| stats.iter().map(|s| u64::from(s.leapfrogs)).sum::<u64>();
        self.chains.iter().map(|c| of(&c.warmup.stats) + of(&c.stats)).sum()
    }

    /// The trace of one coordinate in every chain, for the diagnostics: `chains × len`.
    ///
    /// # Panics
    /// If `index` is out of range, as slices do.
    pub fn traces(&self, index: usize) -> Vec<Vec<f64>> {
        assert!(index < self.dim, "coordinate {index} of {}", self.dim);
        let common = self.len() * self.dim;
        let own = |chain: &Chain| -> Vec<f64> {
            chain.draws[..common].iter().skip(index).step_by(self.dim).copied().collect()
        };
        self.chains.iter().map(own).collect()
    }

    /// Divergent transitions among the kept draws of all chains.
    pub fn divergences(&self) -> usize {
        self.chains.iter().map(|c| c.divergences.len()).sum()
    }
}
