//! The interface of a source of runs.

use fem::RunRecord;

use super::ensemble_runs::NamedRuns;
use super::microstructures::Microstructures;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::specimen::images;
use crate::specimen::levels::Level;

/// Source of the runs of a case. A source returns a record for each point of the parameters. The record contains
/// either a curve, from which quantities are computed, or the quantities themselves by name.
pub(crate) trait RunSource: Sync {
    /// Returns the points of finished runs; `None` if the source can compute a run at any point. The design of the case
    /// then chooses the points.
    fn parameter_points(&self) -> Option<Vec<Vec<f64>>> {
        None
    }

    /// Returns the specimens for `runs` runs; `None` if all runs have the same specimen.
    ///
    /// # Errors
    /// Fails if the specimens cannot be generated.
    fn specimens(
        &self,
        inputs: &Inputs<'_>,
        runs: usize,
    ) -> Result<Option<Microstructures>, WorkflowError> {
        let _ = (inputs, runs);
        Ok(None)
    }

    /// Number of mesh files of the stage `mesh` that the runs use, if all runs have the same specimen.
    fn meshes(&self) -> usize {
        0
    }

    /// Adds to a key the keys of the case and the files of this source.
    fn identified(&self, key: RunKey, inputs: &Inputs<'_>) -> RunKey {
        let _ = inputs;
        key
    }

    /// Returns notes about the runs for the user.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// Reads the keys of the case on which the results depend, but not the identity of the runs.
    fn read_rest(&self, inputs: &Inputs<'_>) {
        let _ = inputs;
    }

    /// Returns the records of runs, in the order of the runs. Computes the runs that have no record.
    ///
    /// # Errors
    /// Fails if no run can be computed, or if records cannot be read or written. A failed run is not an error: its record
    /// has the reason.
    fn records(&self, requested: &RequestedRuns<'_>) -> Result<Vec<RunRecord>, WorkflowError>;
}

/// Returns the identity of the runs of a source on these specimens, at points that the prior and the design of the case
/// determine.
///
/// # Errors
/// Fails if a mesh file is missing.
pub(crate) fn key_of_runs(
    inputs: &Inputs<'_>,
    source: &dyn RunSource,
    specimens: Option<&Microstructures>,
) -> Result<RunKey, WorkflowError> {
    let meshes = specimens.map_or(source.meshes(), Microstructures::meshes);
    let files: Vec<String> =
        (images::FIRST..).take(meshes).map(|image| images::mesh_file(image, "msh")).collect();
    files.iter().try_for_each(|name| inputs.file(name).map(drop))?;
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let key =
        source.identified(RunKey::of_simulations(inputs, &["prior", "design"], &files), inputs);
    match specimens {
        // packings have no mesh files: they are made from the specimen of the case
        Some(specimens) if specimens.meshes() == 0 => key.and_specimen(inputs),
        _ => Ok(key),
    }
}

/// Runs that a source returns.
pub(crate) struct RequestedRuns<'a> {
    pub(crate) task: &'a Task<'a>,
    /// Mesh level of the runs; only the built-in source has levels.
    pub(crate) level: Option<&'a Level<'a>>,
    /// Specimens of the runs; `None` if all runs have the same specimen.
    pub(crate) specimens: Option<&'a Microstructures>,
    /// The runs with their folder.
    pub(crate) named: NamedRuns<'a>,
}
