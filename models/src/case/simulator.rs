//! `[simulator]`: a program of the user that computes the runs.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[simulator]`: a program that computes the runs instead of the built-in compression test. Each run has a separate
/// folder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimulatorCase {
    /// Program and its arguments. `{input}` is the name of the input file, `{run}` the number of the run, and `{k1}` the
    /// value of the parameter `k1`.
    pub command: Vec<String>,
    /// Template of the input file: its placeholders, such as `{k1}`, are replaced by values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<PathBuf>,
    /// Further files that the program reads. They are copied to the folder of each run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<PathBuf>,
    /// Name of the file that the program writes: a curve, or a table of quantities.
    #[serde(default = "result_csv")]
    pub result: String,
    /// Wall-clock time after which the program is stopped, s; without it, there is no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-2, max = 1e9))]
    pub time_limit_s: Option<f64>,
    /// Number of further attempts after a failure.
    #[serde(default)]
    #[schemars(range(min = 0, max = 100))]
    pub retries: u32,
}

impl SimulatorCase {
    /// Paths of the files that the runs read: the template, and the further files.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        self.input.iter().chain(&self.files)
    }
}

fn result_csv() -> String {
    "result.csv".to_owned()
}
