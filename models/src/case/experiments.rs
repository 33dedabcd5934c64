//! `[experiments]`: measured curves, or virtual specimens.

use std::borrow::Cow;
use std::path::PathBuf;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

use super::ByParameter;
use crate::record::ReadOptions;

/// `[experiments]`: a table of measured specimens, or virtual specimens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExperimentsCase {
    /// The specimen table; the curves are in the folder `curves/` next to the table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<PathBuf>,
    /// Table of measured quantities, one line per specimen, which replaces curves. Used with runs from outside this
    /// program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<PathBuf>,
    /// Group of specimens to calibrate against. Default: the specimens of all groups.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Test whose specimens are used, by the column `test` of the table. Default: the specimens of all tests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// Treatment of the toe (the soft start) of a curve.
    #[serde(default)]
    pub toe: Toe,
    /// Format of the curves, if they do not have the columns `displacement_mm,force_N`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub read: Option<ReadOptions>,
    /// Simulated specimens with a known truth.
    #[serde(rename = "virtual", skip_serializing_if = "Option::is_none")]
    pub virtual_specimens: Option<VirtualCase>,
}

/// Treatment of the toe of a curve: its soft start, where platens and specimen settle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Toe {
    /// The toe is measured and reported.
    #[default]
    Report,
    /// Displacement is counted from the point where the curve without the toe has zero force.
    Correct,
}

/// `experiments.virtual`: specimens that are simulated with a known truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VirtualCase {
    /// Number of specimens.
    #[serde(default = "eight")]
    #[schemars(range(min = 2, max = 1000))]
    pub specimens: usize,
    /// Seed of microstructures, scatter and noise.
    pub seed: u64,
    /// Group of all virtual specimens, as written to the specimen table.
    #[serde(default = "fifty_degrees")]
    pub group: String,
    /// Lattice spacing of the virtual specimens in mm, if it is finer than the spacing of the case.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Whether each specimen is also scanned, with the scanner of `[specimen.scan]`.
    #[serde(default)]
    pub scans: bool,
    /// Medians over the specimens of the parameters that `[prior]` calibrates.
    pub truth: ByParameter<f64>,
    /// Standard deviation of the logarithm of each parameter between specimens.
    #[serde(default)]
    #[schemars(with = "ByParameter::<Scatter>")]
    pub scatter: ByParameter<f64>,
    /// Measurement noise.
    #[serde(default)]
    pub noise: NoiseCase,
}

/// Schema of a value of `experiments.virtual.scatter`.
struct Scatter;

impl JsonSchema for Scatter {
    fn schema_name() -> Cow<'static, str> {
        "Scatter".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Standard deviation of the logarithm between specimens: 0.03 is 3 %.",
            "type": "number",
            "minimum": 0,
            "maximum": 1,
        })
    }
}

/// `experiments.virtual.noise`: standard deviation of each reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NoiseCase {
    /// Standard deviation of the force in N.
    #[schemars(range(min = 0, max = 1e6))]
    pub force_n: f64,
    /// Standard deviation of the displacement in mm.
    #[schemars(range(min = 0, max = 1))]
    pub displacement_mm: f64,
}

impl VirtualCase {
    /// Inserts the default scatter of the parameters without a given scatter.
    pub(super) fn complete(&mut self) {
        for parameter in self.truth.parameters() {
            if self.scatter.get(parameter).is_none() {
                let usual = parameter.usual_scatter();
                self.scatter.insert(parameter.clone(), usual);
            }
        }
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
