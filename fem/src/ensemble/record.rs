//! Input and record of one run of an ensemble.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::error::EnsembleError;
use crate::problem::{CurvePoint, Sensitivities};

/// The input of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunInput {
    /// Number of the run, unique in the ensemble.
    pub id: usize,
    /// Values of the inputs, in the order of the input names.
    pub inputs: Vec<f64>,
}

impl RunInput {
    /// Creates one run for each point of a design, numbered from 0.
    pub fn numbered(design: &[Vec<f64>]) -> Vec<RunInput> {
        let run = |(id, inputs): (usize, &Vec<f64>)| RunInput { id, inputs: inputs.clone() };
        design.iter().enumerate().map(run).collect()
    }
}

/// The result of a run, as stored in its file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunRecord {
    /// Number of the run.
    pub id: usize,
    /// Names of the inputs, with units.
    pub names: Vec<String>,
    /// Values of the inputs.
    pub inputs: Vec<f64>,
    /// Whether the run finished, or why it failed.
    pub status: RunStatus,
    /// How the test ended.
    pub end: RunEnd,
    /// Wall-clock time of the run, s.
    pub seconds: f64,
    /// The force–displacement curve; incomplete if the run failed.
    pub curve: Vec<CurvePoint>,
    /// Derivatives of the force along the curve, if they were requested.
    #[serde(default, skip_serializing_if = "Sensitivities::is_empty")]
    pub sensitivities: Sensitivities,
    /// Quantities that the simulation reports by name, see [`Outcome::values`](crate::Outcome::values).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub values: BTreeMap<String, f64>,
}

/// Whether a run finished.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// The run finished.
    Finished,
    /// The run failed; the text is the reason.
    Failed(String),
}

/// Reason for the end of a recorded test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunEnd {
    /// The test reached the full displacement.
    Displacement,
    /// The force fell below its peak by the requested fraction.
    BelowPeak,
    /// The specimen did not carry the prescribed force.
    LimitLoad,
    /// The run failed before its end.
    Failed,
}

/// Results of a run, as stored in its record.
#[derive(Default)]
pub(super) struct RunResults {
    pub(super) curve: Vec<CurvePoint>,
    pub(super) sensitivities: Sensitivities,
    pub(super) values: BTreeMap<String, f64>,
}

impl RunRecord {
    /// Creates the record of a run. If the run failed, `end` contains the reason.
    pub(super) fn new(
        run: &RunInput,
        names: &[&str],
        end: Result<RunEnd, String>,
        results: RunResults,
        seconds: f64,
    ) -> RunRecord {
        let (end, status) = match end {
            Ok(end) => (end, RunStatus::Finished),
            Err(reason) => (RunEnd::Failed, RunStatus::Failed(reason)),
        };
        let names = names.iter().map(|name| name.to_string()).collect();
        let (id, inputs) = (run.id, run.inputs.clone());
        let RunResults { curve, sensitivities, values } = results;
        RunRecord { id, names, inputs, status, end, seconds, curve, sensitivities, values }
    }

    /// Returns the curve of a finished run.
    ///
    /// # Errors
    /// [`EnsembleError::Run`] with the reason if the run failed.
    pub fn finished_curve(&self) -> Result<&[CurvePoint], EnsembleError> {
        match &self.status {
            RunStatus::Finished => Ok(&self.curve),
            RunStatus::Failed(reason) => {
                Err(EnsembleError::Run { id: self.id, message: format!("failed: {reason}") })
            }
        }
    }

    /// Returns the names and values of the inputs, as text for messages.
    pub(super) fn described(names: &[impl AsRef<str>], inputs: &[f64]) -> String {
        let pairs: Vec<String> = names
            .iter()
            .zip(inputs)
            .map(|(name, x)| format!("{} = {x:?}", name.as_ref()))
            .collect();
        pairs.join(", ")
    }
}
