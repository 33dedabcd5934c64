//! `[experiments]`: measured curves, or a virtual laboratory.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// `[experiments]`: a laboratory's table, or a virtual laboratory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentsCase {
    /// The specimen table; curves lie in `curves/` beside it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<PathBuf>,
    /// Calibrate against this group of specimens only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Simulated specimens with a known truth.
    #[serde(rename = "virtual", skip_serializing_if = "Option::is_none")]
    pub laboratory: Option<VirtualCase>,
}

/// `experiments.virtual`: specimens that are simulated with a known truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VirtualCase {
    /// Number of specimens.
    #[serde(default = "eight")]
    pub specimens: usize,
    /// Seed of microstructures, scatter and noise.
    pub seed: u64,
    /// Group written to the specimen table.
    #[serde(default = "fifty_degrees")]
    pub group: String,
    /// Lattice spacing in mm of the virtual specimens, if finer than the case's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Median parameters of the specimens.
    pub truth: TruthCase,
    /// Specimen-to-specimen scatter.
    #[serde(default)]
    pub scatter: ScatterCase,
    /// Measurement noise.
    #[serde(default)]
    pub noise: NoiseCase,
}

/// `experiments.virtual.truth`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TruthCase {
    /// Young's modulus in MPa.
    pub young_mpa: f64,
    /// Critical energy release rate in N/mm.
    pub toughness_n_per_mm: f64,
    /// Viscosity in MPa s.
    pub viscosity_mpa_s: f64,
}

impl TruthCase {
    /// In the order of [`PriorCase::NAMES`](super::PriorCase::NAMES).
    pub fn to_array(&self) -> [f64; 3] {
        [self.young_mpa, self.toughness_n_per_mm, self.viscosity_mpa_s]
    }
}

/// `experiments.virtual.scatter`: standard deviation of the logarithm of each parameter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ScatterCase {
    /// Of Young's modulus.
    pub young: f64,
    /// Of the critical energy release rate.
    pub toughness: f64,
    /// Of the viscosity.
    pub viscosity: f64,
}

/// `experiments.virtual.noise`: standard deviation of each reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseCase {
    /// Of the force in N.
    pub force_n: f64,
    /// Of the displacement in mm.
    pub displacement_mm: f64,
}

impl Default for ScatterCase {
    fn default() -> Self {
        Self { young: 0.03, toughness: 0.1, viscosity: 0.05 }
    }
}

impl Default for NoiseCase {
    fn default() -> Self {
        Self { force_n: 0.3, displacement_mm: 0.0002 }
    }
}

fn eight() -> usize {
    8
}

fn fifty_degrees() -> String {
    "50C".into()
}
