//! What a calibration takes beside its simulations: quantities of interest, surrogate, sampler.

use ::surrogate::{DesignMethod, OrderRule};
use serde::{Deserialize, Serialize};

use super::PriorCase;
use crate::qoi::Quantity;

/// `[qoi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QoiCase {
    /// Where the initial slope is taken, as a fraction of the displacement at peak.
    pub slope_fraction: f64,
    /// What specimens and simulations are compared by.
    pub quantities: Vec<Quantity>,
}

/// `[design]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DesignCase {
    /// Number of simulations.
    pub runs: usize,
    /// Seed of the design.
    pub seed: u64,
    /// How the prior box is filled.
    pub method: DesignMethod,
    /// On what the runs are made, if the specimen is a packing.
    pub microstructure: Microstructure,
}

/// `[[extend]]`: a second batch of runs where a posterior was cut by the prior, beside the runs before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExtendCase {
    /// Number of simulations.
    pub runs: usize,
    /// One parameter and where it is extended to; the others keep to `[prior]`.
    pub prior: PriorCase,
}

/// `design.microstructure`: the packings that an ensemble is made on.
///
/// With one packing its deviation from the others enters the posterior unseen; with one a run, the
/// residuals of the surrogate show how packings scatter, and the posterior can take it in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Microstructure {
    /// Every run has a packing of its own.
    #[default]
    PerRun,
    /// All runs share the case's specimen (the paper).
    One,
}

/// `[surrogate]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurrogateCase {
    /// Highest total order tried.
    pub max_order: usize,
    /// Rule that chooses the order.
    pub rule: OrderRule,
}

/// `[calibration]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalibrationCase {
    /// Markov chains.
    pub chains: usize,
    /// Warmup draws a chain.
    pub warmup: usize,
    /// Kept draws a chain.
    pub draws: usize,
    /// Mean acceptance that the step size is tuned to.
    pub target_accept: f64,
    /// Seed of the chains.
    pub seed: u64,
}

/// `[confirm]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConfirmCase {
    /// Simulations at posterior draws, beside the one at the MAP.
    pub draws: usize,
    /// Spacing in mm of the second mesh at the MAP, from which the error of the specimen's mesh is
    /// estimated; absent: half of the specimen's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_spacing_mm: Option<f64>,
}

impl Default for QoiCase {
    fn default() -> Self {
        Self { slope_fraction: 0.3, quantities: Quantity::OF_THE_PAPER.to_vec() }
    }
}

impl Default for DesignCase {
    fn default() -> Self {
        Self {
            runs: 100,
            seed: 1,
            method: DesignMethod::LatinHypercube,
            microstructure: Microstructure::default(),
        }
    }
}

impl Default for SurrogateCase {
    fn default() -> Self {
        Self { max_order: 8, rule: OrderRule::CorrectedLoo }
    }
}

impl Default for CalibrationCase {
    fn default() -> Self {
        Self { chains: 4, warmup: 1000, draws: 2000, target_accept: 0.95, seed: 7 }
    }
}

impl Default for ConfirmCase {
    fn default() -> Self {
        Self { draws: 4, second_spacing_mm: None }
    }
}
