//! Check of the parts of a case whose runs come from outside this program.

use std::path::{Path, PathBuf};

use crate::case::CaseFile;
use crate::error::InputError;
use crate::experiment::SpecimenTable;
use crate::experiments::experiment_inputs;
use crate::experiments::measured_values::{check_measured, read_measured, without_curves};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::stage::Stage;
use crate::results_folder::error::WorkflowError;
use crate::runs::run_sources::{ImportedRuns, check_program};

/// Describes the source of the runs: subject and text of each line.
///
/// # Errors
/// Fails if the imported table cannot be used.
pub(crate) fn source_in_words(file: &CaseFile) -> Result<Vec<(&'static str, String)>, InputError> {
    let (case, mut lines) = (&file.case, Vec::new());
    if let Some(simulator) = &case.simulator {
        let limit = match simulator.time_limit_s {
            Some(limit) => format!("at most {limit} s a run"),
            None => "no time limit".to_owned(),
        };
        let command = simulator.command.join(" ");
        lines.push(("simulator", format!("{command}, which writes {}; {limit}", simulator.result)));
    }
    // the check of the case reports a missing file
    let path = case.design.import.as_ref().map(|import| file.beside(import));
    if let Some(path) = path.filter(|path| path.is_file()) {
        let prior = case.whole_prior().unwrap_or_default();
        let ranges = prior
            .iter()
            .map(|(parameter, parameter_prior)| (parameter.to_string(), parameter_prior.range()));
        let ranges: Vec<_> = ranges.collect();
        let ImportedRuns { records, outside } =
            ImportedRuns::read(&path, &ranges, &case.compared_quantities())?;
        let text = format!(
            "{} imported from {}, {outside} outside the ranges of the priors",
            records.len(),
            path.display()
        );
        lines.push(("runs", text));
    }
    Ok(lines)
}

/// Checks that the program of `[simulator]` exists on this machine. The check of the case reports a program with a path
/// that does not exist.
///
/// # Errors
/// The message of the run.
pub(crate) fn missing_program(file: &CaseFile) -> Result<(), String> {
    let command = file.case.simulator.as_ref().and_then(|simulator| simulator.command.first());
    match command.filter(|program| Path::new(program).components().count() == 1) {
        Some(program) => check_program(&file.path, program),
        None => Ok(()),
    }
}

/// Reads the table of measured quantities and returns its specimens, which have no curves, and the warnings about missing
/// quantities.
///
/// # Errors
/// Fails if the table cannot be used, or if the chosen group has fewer than `least` specimens.
pub(crate) fn measured_specimens(
    file: &CaseFile,
    path: &Path,
    least: usize,
) -> Result<(SpecimenTable, Vec<String>), WorkflowError> {
    let quantities = &file.case.compared_quantities();
    let test = file.case.experiments.as_ref().and_then(|own| own.test.as_deref());
    let mut specimens = read_measured(path, quantities, test)?;
    let folder = file.path.parent().map_or_else(PathBuf::new, Path::to_owned);
    let inputs = Inputs::new(file, &folder, Stage::that_writes);
    let table = without_curves(&specimens);
    let chosen = experiment_inputs::chosen(&inputs, table.clone())?;
    specimens.retain(|measured| chosen.specimens.iter().any(|specimen| specimen.id == measured.id));
    let warnings = check_measured(path, quantities, &specimens, least)?;
    Ok((table, warnings))
}
