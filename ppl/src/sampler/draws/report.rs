//! Statistics of each transition, and the report of the warmup.

use std::{collections::BTreeMap, fmt};

use serde::{Deserialize, Serialize};

use crate::density::Location;
use crate::model::start::StartKind;
use crate::sampler::draws::encoding::{infinite, locations};

/// Statistics of one transition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawStats {
    /// Log density at the draw, in unconstrained space (Jacobian included).
    pub log_density: f64,
    /// Hamiltonian at the draw, `−log p + ½ pᵀM⁻¹p`. For Metropolis: `−log p`.
    pub energy: f64,
    /// Mean of `min(1, e^(H₀−H))` over all leapfrog steps, where H is the Hamiltonian after a step and H₀ the
    /// Hamiltonian at the start of the trajectory. For Metropolis: the acceptance probability.
    pub acceptance: f64,
    /// Leapfrog step size. For Metropolis: the scale of the proposal.
    pub step_size: f64,
    /// Number of completed doublings of the trajectory; 0 for Metropolis.
    pub depth: u32,
    /// Number of density evaluations in the transition, discarded subtrees included.
    pub leapfrogs: u32,
    /// Whether the transition diverged: its energy error exceeded 1000, or the density rejected a point. Positions of
    /// divergences are in [`Chain::divergences`](crate::Chain::divergences).
    pub divergent: bool,
    /// Whether the transition belongs to the warmup.
    pub tuning: bool,
}

impl DrawStats {
    /// Statistics of a random-walk transition, which has no trajectory.
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

/// A divergence in the trajectory of a kept draw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Divergence {
    /// Index of the draw in its chain.
    pub draw: usize,
    /// Last point before the step that diverged, unconstrained.
    pub position: Vec<f64>,
    /// Energy error `H − H₀` of the step that diverged, relative to the start of the trajectory; infinite if the
    /// density rejected the point.
    #[serde(with = "infinite")]
    pub energy_error: f64,
}

/// Inverse mass matrix of a chain at the end of its warmup, an estimate of the posterior covariance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum InverseMassMatrix {
    /// Diagonal matrix: variances, length `dim`.
    Diagonal(Vec<f64>),
    /// Dense matrix, row-major `dim × dim`.
    Dense(Vec<f64>),
    /// Diagonal with a low-rank correction, `D (I + U (Λ − I) Uᵀ) D`.
    LowRank {
        /// D², length `dim`.
        variances: Vec<f64>,
        /// Orthonormal columns of U, concatenated, `rank × dim`.
        vectors: Vec<f64>,
        /// Diagonal of Λ, length `rank`.
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

/// Kind of inverse mass matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MapKind {
    /// Diagonal: variances only.
    Diagonal,
    /// Dense: all correlations.
    Dense,
    /// Diagonal with a low-rank correction: correlations in a few directions only, for densities
    /// with many coordinates.
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

/// An update of the inverse mass matrix during the warmup.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapSwitch {
    /// Index of the warmup transition (0-based) after which the update took place.
    pub draw: usize,
    /// Kind of the inverse mass matrix after the update.
    pub map: MapKind,
    /// Whether the current matrix was better than the new candidates and was therefore kept.
    pub kept: bool,
    /// Whether a new initial step size was searched and the adaptation of the step size was restarted.
    pub restarted: bool,
    /// Fisher divergence per coordinate of each candidate matrix, estimated on draws that were not used for its fit.
    /// The divergence is 0 if the density is normal and the candidate is its covariance. Empty if no candidates were
    /// compared.
    pub divergences: Vec<(MapKind, f64)>,
}

/// All decisions of the warmup, which remain fixed after the warmup. If the warmup was interrupted, only the
/// decisions before the interrupt are included.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WarmupReport {
    /// First point of the chain, unconstrained.
    pub start: Vec<f64>,
    /// Origin of the starting point.
    #[serde(default)]
    pub start_kind: StartKind,
    /// Point at the end of the warmup, unconstrained. Empty if the chain did not complete its warmup.
    #[serde(default)]
    pub end: Vec<f64>,
    /// Statistics of the warmup transitions.
    pub stats: Vec<DrawStats>,
    /// Indices of the warmup transitions (0-based) after which the covariance was estimated.
    pub windows: Vec<usize>,
    /// Decisions of NUTS at each of the `windows`; empty for other samplers.
    pub switches: Vec<MapSwitch>,
    /// Step size of the kept draws.
    pub step_size: f64,
    /// Target acceptance probability to which the step size was tuned. It is larger than the setting if divergences
    /// raised it.
    pub target_acceptance: f64,
    /// Index of the warmup transition (0-based) whose divergence last raised the target acceptance probability;
    /// `None` if it was not raised.
    pub target_raised: Option<usize>,
    /// Inverse mass matrix (NUTS) or covariance of the proposal before scaling (Metropolis).
    pub covariance: InverseMassMatrix,
    /// Number of rejected points per location in the model, initialisation included.
    #[serde(with = "locations")]
    pub rejections: BTreeMap<Location, u64>,
}

impl WarmupReport {
    /// Creates the report of a chain before its first transition.
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
