//! `loo.csv` and `influence.csv`: results of calibrations that each leave out one specimen.

use ppl::Nuts;
use surrogate::Input;

use crate::fracture::{Calibration, CalibrationError, WithoutSpecimen};
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Writes `loo.csv`: the expected log predictive density (elpd) of each specimen under a calibration to the other
/// specimens. Writes `influence.csv`: the shift of each parameter, in posterior standard deviations, if the specimen is
/// left out. Both are computed with importance weights. If the weights of a specimen are unreliable, the posterior without
/// the specimen is sampled instead; a joint calibration of several tests warns of these weights.
///
/// # Errors
/// Fails if a file cannot be written or if the program is interrupted.
pub(crate) fn write_influence(
    task: &Task<'_>,
    result: &Calibration,
    sampler: &Nuts<'_>,
    burn_in: usize,
    ids: &[String],
    parameters: &[Input],
) -> Result<(), WorkflowError> {
    let posteriors = match result.without_each(sampler, burn_in, task.inputs.calibration().seed) {
        Ok(posteriors) => posteriors,
        Err(CalibrationError::LeaveOut(error)) => {
            task.warn(&format!("Specimens are not left out: {error}."));
            return Ok(());
        }
        Err(error) => {
            task.check_interrupt()?;
            return Err(error.into());
        }
    };
    let unreliable: Vec<String> = ids
        .iter()
        .zip(&posteriors)
        .filter(|(_, one)| !one.is_reliable)
        .map(|(id, one)| format!("{id} (Pareto k = {:.2})", one.pareto_k))
        .collect();
    if !unreliable.is_empty() {
        task.warn(&format!(
            "The densities in loo.csv and the shifts in influence.csv are unreliable for {}: the joint calibration is \
             not sampled again without single specimens. Calibrate this test as a case of its own for reliable values.",
            unreliable.join(", ")
        ));
    }
    let row = |(id, one): (&String, &WithoutSpecimen)| {
        [id.clone(), one.elpd.to_string(), one.pareto_k.to_string()]
    };
    let rows = ids.iter().zip(&posteriors).map(row);
    task.write_csv("loo.csv", ["specimen", "elpd", "pareto_k"], rows)?;
    let rows = ids.iter().zip(&posteriors).flat_map(|(id, one)| {
        let method = match (one.is_sampled, one.is_reliable) {
            (true, _) => "sampled",
            (false, true) => "weights",
            (false, false) => "unreliable weights",
        };
        parameters.iter().zip(&one.shifts).map(move |(parameter, shift)| {
            [id.clone(), parameter.name.clone(), shift.to_string(), method.to_owned()]
        })
    });
    task.write_csv("influence.csv", ["specimen", "parameter", "shift_sd", "method"], rows)
}
