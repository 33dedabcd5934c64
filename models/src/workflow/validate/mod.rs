//! Stage `validate`: simulates tests that the calibration does not use at posterior draws, and compares the predictions
//! with held-out specimens.
//!
//! Each entry of `[[validation]]` is a case of its own in the folder `validation/NAME`. Its specimen is meshed there and its
//! held-out specimens are read there by the stages of a calibration.
//!
//! 1. `simulated`: mesh, specimens and runs of one entry
//! 2. `scatter`: scatter between specimens, and the error that all specimens share
//! 3. `compared`: prediction and measurements of one quantity, as rows of the products
//! 4. this module: the stage

mod compared;
mod scatter;
mod simulated;

use super::WorkflowError;
use super::posterior_draws::{Draw, posterior_draws};
use super::task::Task;
use crate::case::ValidationCase;
use crate::progress::say;
use crate::report::validation_figure;
use compared::Compared;
use scatter::Scatter;
use simulated::Simulated;

/// Table of the held-out specimens: one row for each validation, quantity and specimen.
const SPECIMENS: &str = "validation.csv";
/// Table of the quantities: one row for each validation and quantity.
pub(super) const SUMMARY: &str = "validation_summary.csv";

pub(super) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let entries = inputs.validation();
    if entries.is_empty() {
        return Ok("the case has no [[validation]]: nothing to compare".to_owned());
    }
    let calibrated: Vec<String> =
        inputs.qoi().quantities.iter().map(|q| q.column().into_owned()).collect();
    let prior = inputs.prior()?;
    let draws = posterior_draws(inputs, &prior, &calibrated)?;
    let names: Vec<String> = prior.iter().map(|input| input.name.clone()).collect();
    let mut all = Vec::new();
    for entry in entries {
        task.check_interrupt()?;
        let thinned = thinned(&draws, entry.draws);
        let found = validated(task, entry, &names, &calibrated, &thinned);
        all.extend(found.map_err(|error| of_entry(entry, error))?);
    }
    let rows = all.iter().flat_map(Compared::specimen_rows);
    task.write_csv(SPECIMENS, Compared::SPECIMEN_COLUMNS, rows)?;
    let rows = all.iter().map(Compared::summary_row);
    task.write_csv(SUMMARY, Compared::SUMMARY_COLUMNS, rows)?;
    let shown: Vec<_> = all.iter().map(Compared::shown).collect();
    task.write("validation.svg", validation_figure(&shown))?;
    let contradicted = all.iter().filter(|own| own.is_contradicted()).count();
    Ok(format!("{contradicted} of {} quantities contradict the prediction", all.len()))
}

/// Simulates one entry and compares its quantities.
fn validated(
    task: &Task<'_>,
    entry: &ValidationCase,
    names: &[String],
    calibrated: &[String],
    draws: &[&Draw],
) -> Result<Vec<Compared>, WorkflowError> {
    say("validate", &entry.name);
    let simulated = Simulated::of(task, entry, names, draws)?;
    let scatter = Scatter::of(task, entry, calibrated, &simulated)?;
    let unknown: Vec<&str> = scatter.unknown().collect();
    if !unknown.is_empty() {
        let text = format!(
            "{}: the scatter of {} between specimens is not calibrated, so that only its mean is judged. State it as \
             scatter_percent",
            entry.name,
            unknown.join(", ")
        );
        say("note", &text);
    }
    let draws: Vec<&Draw> = simulated.usable.iter().map(|&k| draws[k]).collect();
    let compared = |m| Compared::of(&entry.name, &simulated, &scatter.of_quantity(m, &draws), m);
    (0..simulated.columns.len()).map(compared).collect()
}

/// Adds the name of the entry to an error.
fn of_entry(entry: &ValidationCase, error: WorkflowError) -> WorkflowError {
    match error {
        WorkflowError::Unusable(text) => {
            WorkflowError::Unusable(format!("the validation {:?}: {text}", entry.name))
        }
        error => error,
    }
}

/// Returns `n` draws, evenly spaced over all chains; all draws if there are fewer.
fn thinned(draws: &[Draw], n: usize) -> Vec<&Draw> {
    let n = n.min(draws.len());
    (0..n).map(|k| &draws[(2 * k + 1) * draws.len() / (2 * n)]).collect()
}
