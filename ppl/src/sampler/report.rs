//! Statistics of every transition, and how a chain was tuned.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use super::encoding::{infinite, locations};
use crate::density::Location;
use crate::start::StartKind;

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
    /// The energy error passed 1000, or a point was rejected; positions are in
    /// [`Chain::divergences`](super::Chain::divergences).
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
pub enum InverseMassMatrix {
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

impl InverseMassMatrix {
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
    /// Where that point came from.
    #[serde(default)]
    pub start_kind: StartKind,
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
    pub covariance: InverseMassMatrix,
    /// Rejected points by their place in the model, initialisation included.
    #[serde(with = "locations")]
    pub rejections: BTreeMap<Location, u64>,
}

impl WarmupReport {
    /// Before the first transition.
    pub(crate) fn at(start: Vec<f64>, start_kind: StartKind) -> Self {
        Self {
            start,
            start_kind,
            end: Vec::new(),
            stats: Vec::new(),
            windows: Vec::new(),
            switches: Vec::new(),
            step_size: 0.0,
            target_acceptance: 0.0,
            target_raised: None,
            covariance: InverseMassMatrix::Diagonal(Vec::new()),
            rejections: BTreeMap::new(),
        }
    }
}
