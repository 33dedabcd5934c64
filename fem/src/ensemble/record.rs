//! One run of an ensemble: what goes in, and what is kept of it.

use serde::{Deserialize, Serialize};

use crate::error::FemError;
use crate::problem::{CurvePoint, End, Outcome};

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
    /// The record of a finished or failed run; nothing if it was interrupted.
    pub(super) fn new(
        run: &RunInput,
        names: &[&str],
        outcome: Result<Outcome, FemError>,
        seconds: f64,
    ) -> Option<RunRecord> {
        let (end, reason, curve) = match outcome {
            Err(error) => (RunEnd::Failed, error.to_string(), Vec::new()),
            Ok(Outcome { curve, end, .. }) => match end {
                End::Displacement => (RunEnd::Displacement, String::new(), curve),
                End::BelowPeak => (RunEnd::BelowPeak, String::new(), curve),
                End::Failed(error) => (RunEnd::Failed, error.to_string(), curve),
                End::Interrupted => return None,
            },
        };
        let status = match end {
            RunEnd::Failed => RunStatus::Failed(reason),
            _ => RunStatus::Finished,
        };
        let names = names.iter().map(|name| name.to_string()).collect();
        Some(RunRecord {
            id: run.id,
            names,
            inputs: run.inputs.clone(),
            status,
            end,
            seconds,
            curve,
        })
    }

    /// The record of a run that failed without a curve.
    pub(super) fn failed(
        run: &RunInput,
        names: &[&str],
        reason: String,
        seconds: f64,
    ) -> RunRecord {
        RunRecord {
            id: run.id,
            names: names.iter().map(|name| name.to_string()).collect(),
            inputs: run.inputs.clone(),
            status: RunStatus::Failed(reason),
            end: RunEnd::Failed,
            seconds,
            curve: Vec::new(),
        }
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
