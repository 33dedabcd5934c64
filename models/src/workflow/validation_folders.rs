//! Results folders of `[[validation]]`. Each validation has a folder within the results folder, with copies of its files and
//! the products of the stages that prepare its specimen and its held-out specimens.

use std::path::{Path, PathBuf};

use super::WorkflowError;
use super::measured_values::read_measured;
use crate::case::{CaseFile, SingleTest, validation_case};
use crate::error::InputError;
use crate::experiment::Specimen;
use crate::same_test::is_same_test;
use crate::specimen_files::SpecimenFiles;

/// Name of the stage that compares held-out specimens with their predictions.
pub(super) const VALIDATE: &str = "validate";

/// Stages that are run in the folder of a validation.
pub(super) const PREPARATION: [&str; 3] = ["segment", "mesh", "experiments"];

/// Advice if a held-out specimen is also a specimen of the calibration.
const HOLD_OUT: &str = "Hold the specimen out of the calibration: remove its line from the table of [experiments], or give \
                        it another group; or leave it out of the validation.";

/// Folder of the results of a validation, within the results folder of the case.
pub(super) fn folder_of(name: &str) -> String {
    format!("validation/{name}")
}

/// The cases of all validations, with their names.
///
/// # Errors
/// Fails if a validation has a mistake or uses a specimen of the calibration.
pub(super) fn held_out_cases(source: &CaseFile) -> Result<Vec<(String, CaseFile)>, WorkflowError> {
    let mut cases = Vec::new();
    for (index, entry) in source.case.validation.iter().enumerate() {
        let held_out = validation_case(source, entry, index).map_err(|errors| {
            let mistakes = || WorkflowError::Unusable(format!("{}: mistakes", entry.name));
            errors.into_iter().next().map_or_else(mistakes, WorkflowError::from)
        })?;
        refuse_calibrated(source, &held_out)?;
        cases.push((entry.name.clone(), held_out));
    }
    Ok(cases)
}

/// Refuses held-out specimens of a test that the calibration of another test uses.
///
/// # Errors
/// Fails if a validation has a mistake; names the table of the held-out specimens and the specimen.
pub(super) fn refuse_calibrated_by_others(tests: &[SingleTest]) -> Result<(), InputError> {
    for test in tests {
        for (place, entry) in test.file.case.validation.iter().enumerate() {
            let own = validation_case(&test.file, entry, place);
            let own = own.map_err(|errors| {
                let mistakes =
                    || InputError::new(&test.file.path, &entry.name, "", "has mistakes", "");
                errors.into_iter().next().unwrap_or_else(mistakes)
            })?;
            let others = tests.iter().filter(|other| other.name != test.name);
            others.into_iter().try_for_each(|other| refuse_calibrated(&other.file, &own))?;
        }
    }
    Ok(())
}

/// Refuses held-out specimens that the calibration uses: specimens with the readings of the same test, or with the same name and the same
/// measured quantities.
///
/// # Errors
/// Names the table of the held-out specimens and the specimen.
pub(super) fn refuse_calibrated(
    calibration: &CaseFile,
    held_out: &CaseFile,
) -> Result<(), InputError> {
    let refuse = |path: &Path, id: &str, other: &str| {
        let problem = format!("has the data of {other}, which the calibration uses");
        Err(InputError::new(path, "specimen", id, problem, HOLD_OUT))
    };
    if let (Some((_, calibrated)), Some((path, measured_specimens))) =
        (measured(calibration), measured(held_out))
    {
        for specimen in &measured_specimens {
            let is_same = |other: &&Specimen| is_same_test(&other.curve, &specimen.curve);
            if let Some(other) = calibrated.iter().find(is_same) {
                return refuse(&path, &specimen.id, &other.id);
            }
        }
    }
    let values = |file: &CaseFile| {
        let path = file.beside(file.case.experiments.as_ref()?.values.as_ref()?);
        // tables of other quantities cannot be compared
        let rows = read_measured(&path, &held_out.case.compared_quantities()).ok()?;
        let group = file.case.experiments.as_ref()?.group.clone();
        let is_chosen = move |specimen_group: &str| {
            group.as_deref().is_none_or(|group| group == specimen_group)
        };
        let rows = rows.into_iter().filter(move |row| is_chosen(&row.group));
        Some((path, rows.collect::<Vec<_>>()))
    };
    if let (Some((_, calibrated)), Some((path, measured_specimens))) =
        (values(calibration), values(held_out))
    {
        for specimen in &measured_specimens {
            // two missing values (NaN) are the same
            let is_equal = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
            let has_values = |values: &[f64]| values.iter().zip(&specimen.values).all(is_equal);
            let is_same =
                calibrated.iter().any(|other| other.id == specimen.id && has_values(&other.values));
            if is_same {
                return refuse(&path, &specimen.id, &specimen.id);
            }
        }
    }
    Ok(())
}

/// The table of measured specimens of a case, and the specimens that the case chooses. `None` if the case has no such table,
/// or if the table has mistakes, which the checks of the case report.
fn measured(file: &CaseFile) -> Option<(PathBuf, Vec<Specimen>)> {
    let experiments = file.case.experiments.as_ref()?;
    let path = file.beside(experiments.table.as_ref()?);
    if !path.is_file() {
        return None;
    }
    let options = experiments.read.clone().unwrap_or_default();
    let read = SpecimenFiles::read(&path, &options).of_test(experiments.test.as_deref(), &path);
    let table = match &experiments.group {
        Some(group) => read.table.in_group(group, &file.path).ok()?,
        None => read.table,
    };
    Some((path, table.specimens))
}
