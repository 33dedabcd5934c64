//! Runs of a mesh level: computation of the runs, and their quantities of interest.

use fem::{RunInput, RunRecord, TetMesh};

use super::ensemble_runs::NamedRuns;
use super::microstructures::Microstructures;
use super::run_source::{RequestedRuns, RunSource};
use crate::case::QoiComparison;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::simulation::run_values::{jacobian, quantities};
use crate::specimen::images;
use crate::specimen::levels::Level;

/// Subfolder with the records of runs.
pub(crate) const FOLDER: &str = "ensemble";

/// Name of the curve file of a run that was repeated on a more accurate mesh. The cheapest level is level 1.
pub(crate) fn curve_of_level(level: usize, run: &str) -> String {
    format!("curves/level-{level}-run-{run:0>3}.csv")
}

/// Computes the runs of a level.
pub(crate) struct Runner<'a> {
    pub(crate) task: &'a Task<'a>,
    pub(crate) source: &'a dyn RunSource,
    /// Names of the runs' inputs.
    pub(crate) names: &'a [String],
    /// Specimens of the runs; `None` if all runs use the specimen of the case.
    pub(crate) specimens: Option<&'a Microstructures>,
}

impl Runner<'_> {
    /// Computes the unfinished runs and returns the records in the order of `runs`. If `wait` is false, the function
    /// returns as soon as other processes are computing all missing runs; only the records that exist at this time
    /// are then returned.
    pub(crate) fn run(
        &self,
        level: &Level<'_>,
        runs: &[RunInput],
        wait: bool,
    ) -> Result<Vec<RunRecord>, WorkflowError> {
        let Self { task, source, names, specimens } = *self;
        let Level { label, key, .. } = level;
        let named = NamedRuns { folder: FOLDER, label, key, names, runs, wait };
        source.records(&RequestedRuns { task, level: Some(level), specimens, named })
    }
}

impl Runner<'_> {
    /// Mesh of a run on a level.
    pub(crate) fn mesh(&self, level: &Level<'_>, run: usize) -> Result<TetMesh, WorkflowError> {
        match self.specimens {
            Some(specimens) => specimens.mesh(&self.task.inputs, level, run),
            None => level.mesh(&self.task.inputs, images::FIRST),
        }
    }
}

/// The runs of a level with their quantities of interest.
pub(crate) struct LevelRuns {
    pub(crate) records: Vec<RunRecord>,
    /// Quantities of each record, or the reason why the run has no quantities.
    results: Vec<Result<RunQuantities, String>>,
}

/// Quantities of interest of a run.
struct RunQuantities {
    quantities: Vec<f64>,
    /// Derivatives of the quantities (rows) with respect to the parameters (columns); empty if no
    /// derivatives were computed.
    jacobian: Vec<Vec<f64>>,
}

impl LevelRuns {
    /// Computes the quantities of the records, with derivatives if requested.
    pub(crate) fn new(records: Vec<RunRecord>, qoi: &QoiComparison, derivatives: bool) -> Self {
        let result = |record| {
            let jacobian = || if derivatives { jacobian(record, qoi) } else { Ok(Vec::new()) };
            Ok(RunQuantities { quantities: quantities(record, qoi)?, jacobian: jacobian()? })
        };
        let results = records.iter().map(result).collect();
        Self { records, results }
    }

    /// Appends the runs of `more`.
    pub(crate) fn extend(&mut self, more: Self) {
        self.records.extend(more.records);
        self.results.extend(more.results);
    }

    /// Runs with quantities.
    pub(crate) fn usable(&self) -> impl Iterator<Item = (&RunRecord, &[f64])> {
        self.differentiated().map(|(record, quantities, _)| (record, quantities))
    }

    /// Runs with quantities and their derivatives (quantities × parameters; empty if not requested).
    pub(crate) fn differentiated(&self) -> impl Iterator<Item = (&RunRecord, &[f64], &[Vec<f64>])> {
        let all = self.records.iter().zip(&self.results);
        all.filter_map(|(record, result)| {
            let RunQuantities { quantities, jacobian } = result.as_ref().ok()?;
            Some((record, &quantities[..], &jacobian[..]))
        })
    }

    /// Runs without quantities, each with the reason.
    pub(crate) fn failed(&self) -> impl Iterator<Item = (&RunRecord, &str)> {
        let all = self.records.iter().zip(&self.results);
        all.filter_map(|(record, result)| Some((record, result.as_ref().err()?.as_str())))
    }
}
