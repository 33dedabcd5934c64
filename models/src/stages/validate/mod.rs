//! Stage `validate`: predicts specimens that the calibration does not use, and compares the predictions with their
//! measurements.
//!
//! Each entry of `[[validation]]` is a separate case in the folder `validation/NAME`. Its specimen is meshed there and
//! its held-out specimens are read there by the stages of a calibration (`crate::experiments::validation_folders`).
//!
//! 1. `calibrated`: posterior draws; `held_out`: measurements of the held-out specimens
//! 2. `predicted`: prediction of one quantity, the scatter between specimens
//! 3. `emulated`, `simulated`: predictions by the surrogate, and by simulations at posterior draws
//! 4. `curves`: curves of new specimens
//! 5. `compared`: prediction and measurements of one quantity, as rows of the products
//! 6. this module: the stage

mod calibrated;
mod compared;
mod curves;
mod emulated;
mod held_out;
mod predicted;
mod simulated;

use std::collections::BTreeMap;

use crate::case::{CaseFile, ValidationCase};
use crate::experiments::validation_folders::{PREPARATION, folder_of};
use crate::forward::fitted::Fitted;
use crate::forward::posterior_draws::{Draw, posterior_draws};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::report::ValidationVerdict;
use crate::results_folder::error::WorkflowError;
use crate::validation::Coverage;
use calibrated::Calibrated;
use compared::{Compared, LEVELS, verdicts};
use curves::Band;
use held_out::HeldOut;

/// Level of the interval of a coverage.
const CONFIDENCE: f64 = 0.95;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let entries = inputs.validation();
    if entries.is_empty() {
        return Ok("the case has no [[validation]]: nothing to compare".to_owned());
    }
    let fitted = Fitted::read(inputs)?;
    let prior = inputs.prior()?;
    let draws = posterior_draws(inputs, &prior, fitted.pce.outputs())?;
    let names = prior.into_iter().map(|input| input.name).collect();
    let mut elsewhere = BTreeMap::new();
    for entry in entries.iter().filter(|entry| !inputs.has_surrogate_for(entry)) {
        if let Some(theta) = draws_in_other_test(inputs, entry)? {
            let draw = |(theta, draw): (Vec<f64>, &Draw)| Draw { theta, ..draw.clone() };
            let own = theta.into_iter().zip(&draws).map(draw).collect();
            elsewhere.insert(entry.name.clone(), own);
        }
    }
    let calibrated = Calibrated { names, draws, elsewhere, fitted };
    let (mut all, mut bands) = (Vec::new(), Vec::new());
    for entry in entries {
        task.check_interrupt()?;
        let (compared, band) =
            validated(task, entry, &calibrated).map_err(|error| of_entry(entry, error))?;
        all.extend(compared);
        bands.extend(band.map(|band| (entry.name.as_str(), band)));
    }
    let verdicts = verdicts(&all);
    task.write_csv(
        "validation.csv",
        Compared::SPECIMEN_COLUMNS,
        all.iter().flat_map(Compared::specimen_rows),
    )?;
    let rows = all.iter().zip(&verdicts).map(|(result, verdict)| result.summary_row(*verdict));
    task.write_csv("validation_summary.csv", Compared::SUMMARY_COLUMNS, rows)?;
    write_coverage(task, &all)?;
    if !bands.is_empty() {
        let rows = bands.iter().flat_map(|(name, band)| band.rows(name));
        task.write_csv("validation_curves.csv", Band::COLUMNS, rows)?;
    }
    let contradicted = verdicts.iter().filter(|v| **v == ValidationVerdict::Contradicted).count();
    Ok(format!("{contradicted} of {} quantities contradict their prediction", all.len()))
}

/// Predicts the specimens of one entry and compares their quantities and curves.
fn validated(
    task: &Task<'_>,
    entry: &ValidationCase,
    calibrated: &Calibrated,
) -> Result<(Vec<Compared>, Option<Band>), WorkflowError> {
    let folder = folder_of(&entry.name);
    let dir = task.path(&folder);
    let file = CaseFile::read(&dir.join("case.toml"))?;
    let inputs = task.inputs.of_folder(&file, &dir).of_held_out();
    for stage in PREPARATION {
        warn_of(task, &inputs, entry, stage)?;
    }
    let held_out = HeldOut::read(&inputs)?;
    calibrated.check_scatter(entry, &held_out.quantities)?;
    let is_emulated = task.inputs.has_surrogate_for(entry);
    let (predictions, band) = match is_emulated {
        true => {
            let predictions = emulated::predictions(task, entry, calibrated, &held_out)?;
            (predictions, curves::emulated(&task.inputs, &inputs)?)
        }
        false => {
            let validation_task = task.with(task.inputs.of_folder(&file, &dir));
            let runs = simulated::Runs::at_draws(task, &validation_task, entry, calibrated)?;
            task.inputs.reads_in_folder(&validation_task.inputs, &folder);
            let predictions = runs.predictions(task, entry, calibrated, &held_out)?;
            (predictions, curves::simulated(&inputs, &runs)?)
        }
    };
    task.inputs.reads_in_folder(&inputs, &folder);
    let unknown: Vec<&str> = held_out
        .columns
        .iter()
        .zip(&predictions)
        .filter(|(_, result)| !result.is_scatter_known)
        .map(|(column, _)| column.as_str())
        .collect();
    if !unknown.is_empty() {
        let text = format!(
            "{}: the scatter of {} between specimens is not calibrated, so that only its mean is judged; state it as \
             scatter_percent",
            entry.name,
            unknown.join(", ")
        );
        say("note", &text);
    }
    let method = if is_emulated { "surrogate" } else { "simulations" };
    let compared = predictions.into_iter().enumerate().map(|(m, predicted)| Compared {
        validation: entry.name.clone(),
        column: held_out.columns[m].clone(),
        method,
        specimens: held_out.of_quantity(m),
        predicted,
    });
    Ok((compared.collect(), band))
}

/// Reads the draws at which a validation simulates its test, if several tests were calibrated together.
fn draws_in_other_test(
    inputs: &Inputs<'_>,
    entry: &ValidationCase,
) -> Result<Option<Vec<Vec<f64>>>, WorkflowError> {
    let Some(joint) = &inputs.calibration().joint else { return Ok(None) };
    let name = joint.with_file_name("validation").join(format!("{}.json", entry.name));
    let name = name.to_string_lossy();
    match inputs.file_if_there(&name) {
        Some(_) => inputs.json(&name).map(Some),
        None => {
            let path = inputs.folder().join(&*name);
            Err(WorkflowError::Missing { path, stage: "calibrate" })
        }
    }
}

/// Repeats the warnings of a stage in the folder of the entry.
fn warn_of(
    task: &Task<'_>,
    validation_inputs: &Inputs<'_>,
    entry: &ValidationCase,
    stage: &str,
) -> Result<(), WorkflowError> {
    let name = crate::results_folder::files::warnings_of(stage);
    if validation_inputs.file_if_there(&name).is_some() {
        let text = validation_inputs.text(&name)?;
        text.lines().for_each(|line| task.warn(&format!("Validation {}: {line}", entry.name)));
    }
    Ok(())
}

/// Writes the coverage of the intervals over all quantities with a known scatter. The interval of the coverage assumes
/// independent specimens; the verdicts allow for the parameters that the specimens share.
fn write_coverage(task: &Task<'_>, all: &[Compared]) -> Result<(), WorkflowError> {
    let rows = LEVELS.iter().enumerate().filter_map(|(k, level)| {
        let counts = all.iter().filter_map(|compared| compared.coverage().map(|levels| levels[k]));
        let add = |a: Coverage, b: Coverage| Coverage {
            inside: a.inside + b.inside,
            total: a.total + b.total,
        };
        let coverage = counts.fold(Coverage { inside: 0, total: 0 }, add);
        if coverage.total == 0 {
            return None;
        }
        let [low, high] = coverage.interval(CONFIDENCE);
        let counts = [coverage.inside, coverage.total].map(|n| n.to_string());
        let fractions = [coverage.fraction(), low, high].map(|x| x.to_string());
        Some([level.to_string()].into_iter().chain(counts).chain(fractions).collect::<Vec<_>>())
    });
    let rows: Vec<_> = rows.collect();
    let header = ["level", "inside", "total", "fraction", "low", "high"];
    task.write_csv("validation_coverage.csv", header, rows)
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
