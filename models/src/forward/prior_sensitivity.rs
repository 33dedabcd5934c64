//! `sensitivity.csv` and `evidence.csv`: influence of the priors on the parameters, and the marginal likelihood.

use ppl::{PowerScalingError, Sensitivity};

use crate::bridge::{BridgeError, MarginalLikelihood};
use crate::fracture::PriorSensitivity;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Largest Pareto k at which sensitivities are reliable.
const LARGEST_K: f64 = 0.7;

/// Writes `sensitivity.csv`: the sensitivity of each parameter to the priors of the parameters, to the priors of the scatter and to the
/// data. Warns of priors that conflict with the data.
///
/// # Errors
/// Fails if the file cannot be written.
pub(crate) fn write_sensitivity(
    task: &Task<'_>,
    found: Result<Vec<PriorSensitivity>, PowerScalingError>,
) -> Result<(), WorkflowError> {
    let found = found.unwrap_or_else(|error| {
        task.warn(&format!("The influence of the priors is unknown: {error}."));
        Vec::new()
    });
    for one in found.iter().filter(|one| is_conflict(one)) {
        task.warn(&format!(
            "The posterior of {} is a compromise between prior and data, which disagree: its sensitivity is {:.2} to the prior \
             and {:.2} to the data. Check the prior against what is known, and the data against the model.",
            one.parameter, one.prior, one.likelihood
        ));
    }
    let row = |one: &PriorSensitivity| {
        let sensitivities = [one.prior, one.scatter_prior, one.likelihood, one.pareto_k];
        let diagnosis = match one.diagnosis() {
            _ if one.pareto_k > LARGEST_K => "unreliable",
            Sensitivity::None => "prior has little influence",
            Sensitivity::PriorDataConflict => "prior and data disagree",
            Sensitivity::StrongPrior => "prior dominates",
        };
        let cells = [one.parameter.clone()].into_iter().chain(sensitivities.map(|x| x.to_string()));
        cells.chain([diagnosis.to_owned()]).collect::<Vec<_>>()
    };
    let header = ["parameter", "prior", "scatter_prior", "likelihood", "pareto_k", "diagnosis"];
    task.write_csv("sensitivity.csv", header, found.iter().map(row))
}

fn is_conflict(one: &PriorSensitivity) -> bool {
    one.pareto_k <= LARGEST_K && one.diagnosis() == Sensitivity::PriorDataConflict
}

/// Writes `evidence.csv`: the logarithm of the marginal likelihood and its standard error, if the case asks for it. Without a reliable
/// estimate, warns and writes the file without numbers.
///
/// # Errors
/// Fails if the file cannot be written.
pub(crate) fn write_evidence(
    task: &Task<'_>,
    estimate: impl FnOnce(u64) -> Result<MarginalLikelihood, BridgeError>,
) -> Result<(), WorkflowError> {
    let settings = task.inputs.calibration();
    if !settings.evidence {
        return Ok(());
    }
    let cells = match estimate(settings.seed) {
        Ok(found) => [found.ln, found.error].map(|x| x.to_string()),
        Err(error) => {
            task.warn(&format!(
                "The evidence is not estimated: {error}. More draws (calibration.draws) reduce the error."
            ));
            [String::new(), String::new()]
        }
    };
    task.write_csv("evidence.csv", ["ln_evidence", "error"], [cells])
}
