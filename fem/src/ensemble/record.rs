//! One run of an ensemble: what goes in, and what is kept of it.

use serde::{Deserialize, Serialize};

use crate::problem::{CurvePoint, Sensitivities};

/// A run to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct RunInput {
    /// Number of the run, unique in its ensemble.
    pub id: usize,
    /// Values of the inputs, in the order of their names.
    pub inputs: Vec<f64>,
}

/// A run that was made, as it stands in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunRecord {
    /// Number of the run.
    pub id: usize,
    /// Names of the inputs, with units.
    pub names: Vec<String>,
    /// Values of the inputs.
    pub inputs: Vec<f64>,
    /// Whether it finished, or why it failed.
    pub status: RunStatus,
    /// Where the test ended.
    pub end: RunEnd,
    /// How long it took (s of wall-clock time).
    pub seconds: f64,
    /// The curve; of a failed run as far as it came.
    pub curve: Vec<CurvePoint>,
    /// The derivatives of the force along it, where they were asked for.
    #[serde(default, skip_serializing_if = "Sensitivities::is_empty")]
    pub sensitivities: Sensitivities,
}

/// Whether a run finished.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// It reached its end.
    Finished,
    /// It failed, for this reason.
    Failed(String),
}

/// Where a recorded test ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunEnd {
    /// At the full displacement.
    Displacement,
    /// When the force had fallen below its peak as far as asked.
    BelowPeak,
    /// Before its end, by a failure.
    Failed,
}

impl RunRecord {
    /// The record of a run; `end` is why it failed where it did.
    pub(super) fn new(
        run: &RunInput,
        names: &[&str],
        end: Result<RunEnd, String>,
        (curve, sensitivities): (Vec<CurvePoint>, Sensitivities),
        seconds: f64,
    ) -> RunRecord {
        let (end, status) = match end {
            Ok(end) => (end, RunStatus::Finished),
            Err(reason) => (RunEnd::Failed, RunStatus::Failed(reason)),
        };
        let names = names.iter().map(|name| name.to_string()).collect();
        let (id, inputs) = (run.id, run.inputs.clone());
        RunRecord { id, names, inputs, status, end, seconds, curve, sensitivities }
    }

    /// Names and values of the inputs as a person reads them.
    pub(super) fn described(names: &[impl AsRef<str>], inputs: &[f64]) -> String {
        let pairs: Vec<String> = names
            .iter()
            .zip(inputs)
            .map(|(name, x)| format!("{} = {x:?}", name.as_ref()))
            .collect();
        pairs.join(", ")
    }
}
