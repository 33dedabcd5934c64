//! What a sampler leaves behind: draws, statistics of every transition, and how it was tuned.

use std::{collections::BTreeMap, fmt};

use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::{
    store::{infinite, places},
    tuning::Tuning,
};
use crate::density::Place;

/// Statistics of one transition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawStats {
    /// Log density at the draw, in unconstrained space (Jacobian included).
    pub log_density: f64,
    /// Hamiltonian at the draw, `−log p + ½ pᵀM⁻¹p`; for Metropolis `−log p`.
    pub energy: f64,
    /// Mean of `min(1, e^(H₀−H))` over all leapfrogs; for Metropolis the acceptance probability.
    pub acceptance: f64,
    /// Leapfrog step; for Metropolis the scale of the proposal.
    pub step_size: f64,
    /// Completed doublings of the trajectory (0 for Metropolis).
    pub depth: u32,
    /// Evaluations of the density in the transition, discarded subtrees included.
    pub leapfrogs: u32,
    /// The energy error passed 1000, or a point was rejected; positions are in [`Chain::divergences`].
    pub divergent: bool,
    /// The transition belongs to the warmup.
    pub tuning: bool,
}

impl DrawStats {
    /// Of a transition without trajectory.
    pub(crate) fn walk(log_density: f64, acceptance: f64, scale: f64, evaluations: u32) -> Self {
        Self {
            log_density,
            energy: -log_density,
            acceptance,
            step_size: scale,
            depth: 0,
            leapfrogs: evaluations,
            divergent: false,
            tuning: false,
        }
    }
}

/// Where a trajectory of a kept draw diverged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Divergence {
    /// Index of the draw in its chain.
    pub draw: usize,
    /// Last point (unconstrained) before the step that diverged.
    pub position: Vec<f64>,
    /// Energy error `H − H₀` of that step; infinite for a rejected point.
    #[serde(with = "infinite")]
    pub energy_error: f64,
}

/// The mass matrix of a chain at the end of its warmup, as an estimate of the posterior covariance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Covariance {
    /// Variances, length `dim`.
    Diagonal(Vec<f64>),
    /// Full matrix, row-major `dim × dim`.
    Dense(Vec<f64>),
    /// `D (I + U (Λ − I) Uᵀ) D`.
    LowRank {
        /// D², length `dim`.
        variances: Vec<f64>,
        /// The orthonormal columns of U one after the other, `rank × dim`.
        vectors: Vec<f64>,
        /// Λ, length `rank`.
        values: Vec<f64>,
    },
}

impl Covariance {
    /// The full matrix, row-major `dim × dim`.
    pub fn matrix(&self) -> Vec<f64> {
        match self {
            Self::Dense(matrix) => matrix.clone(),
            Self::Diagonal(variances) => Self::assemble(variances, &[], &[]),
            Self::LowRank { variances, vectors, values } => {
                Self::assemble(variances, vectors, values)
            }
        }
    }

    fn assemble(variances: &[f64], vectors: &[f64], values: &[f64]) -> Vec<f64> {
        let dim = variances.len();
        let mut matrix = vec![0.0; dim * dim];
        for i in 0..dim {
            matrix[i * dim + i] = variances[i];
            for (u, value) in vectors.chunks_exact(dim).zip(values) {
                for j in 0..dim {
                    let scale = (variances[i] * variances[j]).sqrt();
                    matrix[i * dim + j] += (value - 1.0) * u[i] * u[j] * scale;
                }
            }
        }
        matrix
    }
}

/// A kind of mass matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MapKind {
    /// Variances only.
    Diagonal,
    /// All correlations.
    Dense,
    /// Correlations in a few directions, for many coordinates.
    LowRank {
        /// Number of directions.
        rank: usize,
    },
}

impl fmt::Display for MapKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Diagonal => write!(f, "diagonal"),
            Self::Dense => write!(f, "dense"),
            Self::LowRank { rank } => write!(f, "diagonal with {rank} correlated directions"),
        }
    }
}

/// A moment of the warmup at which the mass matrix was reconsidered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapSwitch {
    /// Warmup transition (0-based) after which it took place.
    pub draw: usize,
    /// The mass matrix from then on.
    pub map: MapKind,
    /// The mass matrix before was better than the new ones, and stayed.
    pub kept: bool,
    /// The search and adaptation of the step began anew.
    pub restarted: bool,
    /// Fisher divergence per coordinate of each kind compared, on draws not fitted to (0: the
    /// density is normal in these coordinates); empty where nothing was compared.
    pub divergences: Vec<(MapKind, f64)>,
}

/// All that the warmup decided; nothing of it changes afterwards. After an interrupt in the warmup:
/// what it had decided so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WarmupReport {
    /// First point of the chain, unconstrained.
    pub start: Vec<f64>,
    /// Its point at the end of the warmup, unconstrained; empty if it did not come so far.
    #[serde(default)]
    pub end: Vec<f64>,
    /// Statistics of the warmup transitions.
    pub stats: Vec<DrawStats>,
    /// Warmup transitions (0-based) after which the covariance was estimated anew.
    pub windows: Vec<usize>,
    /// What NUTS decided at each of them; empty for other samplers.
    pub switches: Vec<MapSwitch>,
    /// Step size of the kept draws.
    pub step_size: f64,
    /// Acceptance the step size was tuned to; above the setting if divergences raised it.
    pub target_acceptance: f64,
    /// Warmup transition (0-based) whose divergence raised the target last.
    pub target_raised: Option<usize>,
    /// Inverse mass matrix (NUTS) or covariance of the proposal before scaling (Metropolis).
    pub covariance: Covariance,
    /// Rejected points by their place in the model, initialisation included.
    #[serde(with = "places")]
    pub rejections: BTreeMap<Place, u64>,
}

impl WarmupReport {
    /// Before the first transition.
    pub(crate) fn at(start: Vec<f64>) -> Self {
        Self {
            start,
            end: Vec::new(),
            stats: Vec::new(),
            windows: Vec::new(),
            switches: Vec::new(),
            step_size: 0.0,
            target_acceptance: 0.0,
            target_raised: None,
            covariance: Covariance::Diagonal(Vec::new()),
            rejections: BTreeMap::new(),
        }
    }
}

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
    #[serde(with = "places")]
    pub rejections: BTreeMap<Place, u64>,
    /// Why the chain ended early; `None` if it finished.
    pub stopped: Option<String>,
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
/// `resume` of their sampler, as [`Nuts::resume`](super::Nuts::resume), goes on where they stand.
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

    /// Coordinate `index` of draw `draw` of chain `chain`.
    ///
    /// # Panics
    /// If an index is out of range, as slices do.
    pub fn value(&self, chain: usize, draw: usize, index: usize) -> f64 {
        assert!(index < self.dim, "coordinate {index} of {}", self.dim);
        self.chains[chain].draws[draw * self.dim + index]
    }

    /// The trace of one coordinate in every chain, for the diagnostics: `chains × len`.
    ///
    /// # Panics
    /// If `index` is out of range, as slices do.
    pub fn traces(&self, index: usize) -> Vec<Vec<f64>> {
        let n = self.len();
        (0..self.chains.len()).map(|c| (0..n).map(|i| self.value(c, i, index)).collect()).collect()
    }

    /// Divergent transitions among the kept draws of all chains.
    pub fn divergences(&self) -> usize {
        self.chains.iter().map(|c| c.divergences.len()).sum()
    }
}
