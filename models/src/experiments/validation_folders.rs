//! Results folders of `[[validation]]`. Each validation has a folder within the results folder, with copies of its files and
//! the products of the stages that prepare its specimen and its held-out specimens.

use super::common_specimens::{CommonSpecimen, common_specimen};
use crate::case::{CaseFile, SingleTest, validation_case};
use crate::error::InputError;
use crate::results_folder::error::WorkflowError;

/// Name of the stage that compares held-out specimens with their predictions.
pub(crate) const VALIDATE: &str = "validate";

/// Stages that are run in the folder of a validation.
pub(crate) const PREPARATION: [&str; 3] = ["segment", "mesh", "experiments"];

/// Advice if a held-out specimen is also a specimen of the calibration.
const HOLD_OUT: &str = "Hold the specimen out of the calibration: remove its line from the table of [experiments], or give \
                        it another group; or leave it out of the validation.";

/// Folder of the results of a validation, within the results folder of the case.
pub(crate) fn folder_of(name: &str) -> String {
    format!("validation/{name}")
}

/// The cases of all validations, with their names.
///
/// # Errors
/// Fails if a validation has a mistake or uses a specimen of the calibration.
pub(crate) fn held_out_cases(source: &CaseFile) -> Result<Vec<(String, CaseFile)>, WorkflowError> {
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
pub(crate) fn refuse_calibrated_by_others(tests: &[SingleTest]) -> Result<(), InputError> {
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

/// Refuses held-out specimens that the calibration uses: see [`common_specimen`].
///
/// # Errors
/// Names the table of the held-out specimens and the specimen.
pub(crate) fn refuse_calibrated(
    calibration: &CaseFile,
    held_out: &CaseFile,
) -> Result<(), InputError> {
    let Some(CommonSpecimen { table, id, other }) = common_specimen(calibration, held_out) else {
        return Ok(());
    };
    let problem = format!("has the data of {other}, which the calibration uses");
    Err(InputError::new(&table, "specimen", id, problem, HOLD_OUT))
}
