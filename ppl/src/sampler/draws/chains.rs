//! Result of a sampler: draws, statistics, and the state needed to resume the chains.

use std::collections::BTreeMap;

use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::density::Location;
use crate::sampler::draws::encoding::locations;
use crate::sampler::draws::report::{Divergence, DrawStats, WarmupReport};
use crate::sampler::run::stop::StopReason;
use crate::sampler::walk::tuning::Tuning;

/// Draws, statistics and resumable state of one chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chain {
    /// Draws that were kept after the warmup (and thinning), row-major `n × dim`, unconstrained.
    pub draws: Vec<f64>,
    /// Statistics of the kept draws, length `n`.
    pub stats: Vec<DrawStats>,
    /// Divergences among the kept draws.
    pub divergences: Vec<Divergence>,
    /// Report of the warmup: tuned step size, inverse mass matrix and starting point.
    pub warmup: WarmupReport,
    /// Number of points rejected after the warmup, per location in the model.
    #[serde(with = "locations")]
    pub rejections: BTreeMap<Location, u64>,
    /// Reason why the chain ended early; `None` if the chain finished.
    pub stopped: Option<StopReason>,
    /// State of the random stream after the last kept draw, or after the warmup if there is no draw; needed to resume
    /// the chain. `None` if the chain failed in its warmup.
    pub(crate) stream: Option<Xoshiro256PlusPlus>,
    /// State of a chain that was interrupted in its warmup; `None` for any other chain.
    #[serde(default)]
    pub(crate) paused: Option<Box<Paused>>,
    /// Tuned state of the transition kernel, needed to resume the chain. `None` if the warmup report contains the
    /// complete tuned state.
    #[serde(default)]
    pub(crate) tuning: Option<Box<Tuning>>,
}

/// State of an interrupted chain between two transitions of its warmup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Paused {
    pub(crate) position: Vec<f64>,
    pub(crate) stream: Xoshiro256PlusPlus,
    /// Total number of transitions of the warmup.
    pub(crate) length: usize,
}

impl Paused {
    /// Whether the saved chain has `dim` coordinates and its warmup has at least `transitions` transitions.
    pub(crate) fn fits(&self, dim: usize, transitions: usize) -> bool {
        let possible = transitions..=u32::MAX as usize;
        self.position.len() == dim && possible.contains(&self.length)
    }
}

impl Chain {
    /// Creates a chain without draws.
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

    /// Whether no draw was kept.
    pub fn is_empty(&self) -> bool {
        self.stats.is_empty()
    }
}

/// The chains of one run.
///
/// The chains of an interrupted run can have unequal lengths; [`Chains::len`] is the common length. The method
/// [`resume`](crate::Mcmc::resume) of the sampler continues each chain from its last draw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chains {
    /// Number of unconstrained coordinates.
    pub dim: usize,
    /// The chains in the order of their random streams.
    pub chains: Vec<Chain>,
    /// Largest number of doublings of a trajectory; `None` for Metropolis.
    pub max_depth: Option<u32>,
    /// Number of transitions per kept draw, after the warmup.
    #[serde(default = "every")]
    pub thin: usize,
}

/// Default of `thin` in stored chains: every draw is kept.
fn every() -> usize {
    1
}

impl Chains {
    /// Creates the result of a run from its chains.
    pub(crate) fn new(dim: usize, chains: Vec<Chain>, thin: usize) -> Self {
        Self { dim, chains, max_depth: None, thin }
    }

    /// Number of draws of the shortest chain.
    pub fn len(&self) -> usize {
        self.chains.iter().map(Chain::len).min().unwrap_or(0)
    }

    /// Whether no draw is common to all chains.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of density evaluations in all chains, warmup included. For
    /// [`DelayedAcceptance`](crate::DelayedAcceptance), the number of evaluations of the expensive density.
    pub fn evaluations(&self) -> u64 {
        let evaluations =
            |stats: &[DrawStats]| stats.iter().map(|s| u64::from(s.leapfrogs)).sum::<u64>();
        self.chains.iter().map(|c| evaluations(&c.warmup.stats) + evaluations(&c.stats)).sum()
    }

    /// Returns the trace of one coordinate in every chain, as input of the diagnostics: one vector of common length
    /// per chain.
    ///
    /// # Panics
    /// If `index` is not below `dim`.
    pub fn traces(&self, index: usize) -> Vec<Vec<f64>> {
        assert!(index < self.dim, "coordinate {index} of {}", self.dim);
        let common = self.len() * self.dim;
        let trace = |chain: &Chain| -> Vec<f64> {
            chain.draws[..common].iter().skip(index).step_by(self.dim).copied().collect()
        };
        self.chains.iter().map(trace).collect()
    }

    /// Number of divergent transitions among the kept draws of all chains.
    pub fn divergences(&self) -> usize {
        self.chains.iter().map(|c| c.divergences.len()).sum()
    }
}
