//! Predictions by simulations at posterior draws, for a test that the surrogate does not describe.

use fem::{RunInput, RunRecord};

use super::calibrated::Calibrated;
use super::held_out::HeldOut;
use super::predicted::{Predicted, Scatter};
use crate::case::ValidationCase;
use crate::experiments::validation_folders::folder_of;
use crate::forward::fitted::read_experiments;
use crate::forward::posterior_draws::Draw;
use crate::fracture::column_means;
use crate::pipeline::task::Task;
use crate::qoi::{PeakForce, Quantity};
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::NamedRuns;
use crate::runs::run_source::{RequestedRuns, key_of_runs};
use crate::runs::run_sources::source_of;
use crate::simulation::run_values::quantities;
use crate::specimen::levels::Level;

/// Usable simulations of the test at posterior draws.
pub(super) struct Runs<'a> {
    /// The draw of each run.
    pub(super) draws: Vec<&'a Draw>,
    /// The record of each run.
    pub(super) records: Vec<RunRecord>,
    /// Quantities of each run.
    values: Vec<Vec<f64>>,
    /// Whether the runs have different microstructures.
    has_microstructures: bool,
    /// Scatter of the force between specimens; `None` if it is unknown.
    pub(super) force: Option<ForceScatter>,
}

/// Relative scatter and error of the force of simulated curves; at each displacement, the scatter and the error of the
/// peak force are used.
pub(super) struct ForceScatter {
    /// Variance between specimens at each draw.
    pub(super) variances: Vec<f64>,
    /// Variance between microstructures, which the curves contain.
    pub(super) included: f64,
    /// Standard deviation of the error of the model that all specimens share.
    pub(super) discrepancy_sd: f64,
}

impl<'a> Runs<'a> {
    /// Simulates the test at draws of the posterior. Finished runs are reused. `validation_task` is the task in the folder of the entry.
    ///
    /// # Errors
    /// Fails if fewer than two runs are usable, or if no run can be computed.
    pub(super) fn at_draws(
        task: &Task<'_>,
        validation_task: &Task<'_>,
        entry: &ValidationCase,
        calibrated: &'a Calibrated,
    ) -> Result<Self, WorkflowError> {
        let draws = calibrated.thinned_for(entry);
        let (records, has_microstructures) =
            records(validation_task, entry, &calibrated.names, &draws)?;
        let qoi = validation_task.inputs.qoi();
        let mut runs = Self {
            draws: Vec::new(),
            records: Vec::new(),
            values: Vec::new(),
            has_microstructures,
            force: None,
        };
        let (all, mut failed) = (records.len(), Vec::new());
        for (draw, record) in draws.into_iter().zip(records) {
            match quantities(&record, qoi) {
                Ok(values) => {
                    runs.draws.push(draw);
                    runs.values.push(values);
                    runs.records.push(record);
                }
                Err(reason) => failed.push(format!("run {}: {reason}", record.id)),
            }
        }
        let first = failed.first().map_or("", String::as_str);
        if runs.records.len() < 2 {
            let text = format!("{} of {all} simulations are usable; {first}", runs.records.len());
            return Err(WorkflowError::Unusable(text));
        }
        if !failed.is_empty() {
            task.warn(&format!(
                "The prediction of the validation {} omits {} of {all} posterior draws, whose simulations have no \
                 quantities: {first}.",
                entry.name,
                failed.len(),
            ));
        }
        let scatter = runs.scatter(task, entry, calibrated)?;
        let force = Quantity::new(PeakForce);
        let variances = runs.draws.iter().map(|draw| scatter.relative_variance(&force, draw));
        let variances: Option<Vec<f64>> = variances.collect();
        let included = scatter.included_variance(&force);
        let discrepancy =
            task.inputs.calibration().discrepancy.covariance(&[force.column().into_owned()]);
        let discrepancy_sd = discrepancy.map_or(0.0, |all| all[0][0].sqrt());
        runs.force =
            variances.map(|variances| ForceScatter { variances, included, discrepancy_sd });
        Ok(runs)
    }

    /// Predicts the quantities of the held-out specimens.
    ///
    /// # Errors
    /// Fails if a quantity is not finite.
    pub(super) fn predictions(
        &self,
        task: &Task<'_>,
        entry: &ValidationCase,
        calibrated: &Calibrated,
        held_out: &HeldOut,
    ) -> Result<Vec<Predicted>, WorkflowError> {
        let scatter = self.scatter(task, entry, calibrated)?;
        // the error of the model in another test is independent of its error in the calibrated test
        let discrepancy = task.inputs.calibration().discrepancy.covariance(&held_out.columns);
        let of_quantity = |(m, quantity): (usize, &Quantity)| {
            let means: Vec<f64> = self.values.iter().map(|row| row[m]).collect();
            let sds = scatter.sds(quantity, &self.draws, &means);
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            let shared = discrepancy.as_ref().map_or(0.0, |all| all[m][m].sqrt() * mean.abs());
            let included = scatter.included_variance(quantity);
            let column = &held_out.columns[m];
            Ok(Predicted::new(column, means, sds, shared)?.without_relative_variance(included))
        };
        held_out.quantities.iter().enumerate().map(of_quantity).collect()
    }

    fn scatter<'b>(
        &self,
        task: &Task<'_>,
        entry: &'b ValidationCase,
        calibrated: &'b Calibrated,
    ) -> Result<Scatter<'b>, WorkflowError> {
        let fitted = &calibrated.fitted;
        let outputs = fitted.pce.outputs();
        let of_microstructures = match self.has_microstructures {
            true => {
                let at = column_means(&read_experiments(&task.inputs, outputs)?);
                let variances = fitted.between_microstructures(&at)?;
                variances.map(|all| (0..at.len()).map(|m| all[m][m]).collect())
            }
            false => None,
        };
        Ok(Scatter { entry, calibrated: outputs, of_microstructures, calibrated_means: None })
    }
}

/// Runs the test of the entry at the draws. Returns the records, and whether the runs have different microstructures.
fn records(
    validation_task: &Task<'_>,
    entry: &ValidationCase,
    names: &[String],
    draws: &[&Draw],
) -> Result<(Vec<RunRecord>, bool), WorkflowError> {
    let inputs = &validation_task.inputs;
    if inputs.is_built_in() {
        // the runs depend on the geometry even if no mesh file is read: reading the geometry adds it to the identity of
        // the runs
        inputs.geometry()?;
    }
    let parameters: Vec<String> = inputs.parameters()?.iter().map(ToString::to_string).collect();
    let source = source_of(inputs)?;
    if source.parameter_points().is_some() {
        let text =
            "the runs of the case are imported, so that no run at posterior draws can be made";
        return Err(WorkflowError::Unusable(text.to_owned()));
    }
    let specimens = source.specimens(inputs, draws.len())?;
    let key = key_of_runs(inputs, &*source, specimens.as_ref())?;
    // the last level is the mesh of the case itself
    let Some(level) = Level::all(inputs, &key).pop() else {
        return Err(WorkflowError::Unusable("the case has no mesh".to_owned()));
    };
    source.read_rest(inputs);
    let order = places_of(&parameters, names)?;
    let point = |draw: &&Draw| order.iter().map(|&i| draw.theta[i]).collect::<Vec<f64>>();
    let run = |(i, inputs)| RunInput { id: i + 1, inputs };
    let runs: Vec<RunInput> = draws.iter().map(point).enumerate().map(run).collect();
    // other draws are other runs
    let lines: String = runs.iter().map(|run| format!("draw = {:?}\n", run.inputs)).collect();
    let key = level.key.with(&lines);
    let folder = format!("{}/runs", folder_of(&entry.name));
    let named = NamedRuns {
        folder: &folder,
        label: &format!("runs of {}", entry.name),
        key: &key,
        names: &parameters,
        runs: &runs,
        wait: true,
    };
    let level = inputs.is_built_in().then_some(&level);
    let requested =
        RequestedRuns { task: validation_task, level, specimens: specimens.as_ref(), named };
    Ok((source.records(&requested)?, specimens.is_some()))
}

/// Index of each parameter of the runs in `calibrated`.
fn places_of(parameters: &[String], calibrated: &[String]) -> Result<Vec<usize>, WorkflowError> {
    let index_of = |name: &String| {
        calibrated.iter().position(|other| other == name).ok_or_else(|| {
            let all = calibrated.join(", ");
            let text = format!(
                "its simulations have the parameter {name}, which is not calibrated; calibrated are {all}: give {name} a \
                 value in set, or calibrate it in [prior]"
            );
            WorkflowError::Unusable(text)
        })
    };
    parameters.iter().map(index_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_of_runs_have_their_places_among_the_calibrated_ones() {
        let named = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
        let calibrated = named(&["matrix.young_mpa", "machine.friction"]);
        let places = |names: &[&str]| places_of(&named(names), &calibrated);
        assert_eq!(places(&["machine.friction", "matrix.young_mpa"]).unwrap(), [1, 0]);
        let error = places(&["grain.young_mpa"]).unwrap_err().to_string();
        for part in ["grain.young_mpa", "matrix.young_mpa, machine.friction", "[prior]"] {
            assert!(error.contains(part), "{part}: {error}");
        }
    }
}
