//! What a calibration takes beside its simulations: quantities of interest, prior, surrogate, sampler.

use ::surrogate::{Design, OrderRule};
use serde::{Deserialize, Serialize};

use super::read;

/// `[qoi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QoiCase {
    /// Where the initial slope is taken, as a fraction of the displacement at peak.
    pub slope_fraction: f64,
}

/// `[prior]`: the box of the uniform priors, also the surrogate's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PriorCase {
    /// The region whose parameters are calibrated.
    #[serde(default = "matrix")]
    pub region: String,
    /// Lower and upper bound of Young's modulus in MPa.
    #[serde(deserialize_with = "read::two_numbers")]
    pub young_mpa: [f64; 2],
    /// Bounds of the critical energy release rate in N/mm.
    #[serde(deserialize_with = "read::two_numbers")]
    pub toughness_n_per_mm: [f64; 2],
    /// Bounds of the viscosity in MPa s.
    #[serde(deserialize_with = "read::two_numbers")]
    pub viscosity_mpa_s: [f64; 2],
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
    pub method: Design,
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
}

impl PriorCase {
    /// Names with units, in the order of [`PriorCase::bounds`]: keys of the case, columns of every table.
    pub const NAMES: [&str; 3] = ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"];

    /// Lower and upper bounds of the three parameters.
    pub fn bounds(&self) -> [[f64; 2]; 3] {
        [self.young_mpa, self.toughness_n_per_mm, self.viscosity_mpa_s]
    }
}

impl Default for QoiCase {
    fn default() -> Self {
        Self { slope_fraction: 0.3 }
    }
}

impl Default for DesignCase {
    fn default() -> Self {
        Self { runs: 100, seed: 1, method: Design::LatinHypercube }
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
        Self { draws: 4 }
    }
}

fn matrix() -> String {
    "matrix".into()
}
