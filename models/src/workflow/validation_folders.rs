//! Results folders of `[[validation]]`. Each validation has a folder within the results folder, with copies of its files and
//! the products of the stages that prepare its specimen and its held-out specimens.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::measured_values::read_measured;
use super::product_folder::FolderAccess;
use super::stages::STAGES;
use super::{Workflow, WorkflowError};
use crate::case::CaseFile;
use crate::error::InputError;
use crate::experiment::Specimen;
use crate::progress::speaking_for;
use crate::specimen_files::SpecimenFiles;

/// Name of the stage that compares held-out specimens with their predictions.
pub(super) const VALIDATE: &str = "validate";

/// Stages that are run in the folder of a validation.
const PREPARATION: [&str; 3] = ["segment", "mesh", "experiments"];

/// What to do if a held-out specimen is also calibrated to.
const HOLD_OUT: &str = "Hold the specimen out of the calibration: remove its line from the table of [experiments], or give \
                        it another group; or leave it out of the validation.";

/// Folder of the results of a validation, within the results folder of the case.
pub(super) fn folder_of(name: &str) -> String {
    format!("validation/{name}")
}

/// Opens the folder of each validation of a case.
///
/// # Errors
/// Fails if a validation uses a specimen of the calibration. Also the errors of [`Workflow::open_with`].
pub(super) fn open_validations<'a>(
    source: &CaseFile,
    dir: &Path,
    threads: usize,
    interrupt: &'a AtomicBool,
    access: &FolderAccess,
) -> Result<Vec<(String, Workflow<'a>)>, WorkflowError> {
    let mut opened = Vec::new();
    for (place, entry) in source.case.validation.iter().enumerate() {
        let first = |errors: Vec<InputError>| errors.into_iter().next();
        let own = source.of_validation(entry, place).map_err(|errors| match first(errors) {
            Some(error) => error.into(),
            None => {
                WorkflowError::Unusable(format!("the validation {:?} has mistakes", entry.name))
            }
        })?;
        refuse_calibrated(source, &own)?;
        // the folder belongs to the folder of the case, whose owner has been checked
        let access = FolderAccess { reuse: true, replace: access.replace.clone() };
        let dir = dir.join(folder_of(&entry.name));
        let workflow = Workflow::open_with(&own, &dir, threads, interrupt, &access)?;
        opened.push((entry.name.clone(), Workflow { is_held_out: true, ..workflow }));
    }
    Ok(opened)
}

/// Runs the stages that prepare each validation, unless they are finished.
///
/// # Errors
/// The first error of a stage.
pub(super) fn prepare(validations: &[(String, Workflow<'_>)]) -> Result<(), WorkflowError> {
    let stages = STAGES.iter().filter(|stage| PREPARATION.contains(&stage.name));
    validations.iter().try_for_each(|(name, workflow)| {
        speaking_for(name, || stages.clone().try_for_each(|stage| workflow.make(stage)))
    })
}

/// Refuses held-out specimens that the calibration uses: specimens with the same curve, or with the same name and the same
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
    if let (Some((_, calibrated)), Some((path, own))) = (measured(calibration), measured(held_out))
    {
        for specimen in &own {
            let is_same = |other: &&Specimen| other.curve == specimen.curve;
            if let Some(other) = calibrated.iter().find(is_same) {
                return refuse(&path, &specimen.id, &other.id);
            }
        }
    }
    let values = |file: &CaseFile| {
        let path = file.beside(file.case.experiments.as_ref()?.values.as_ref()?);
        // tables of other quantities cannot be compared
        let rows = read_measured(&path, &held_out.case.qoi.quantities).ok()?;
        let group = file.case.experiments.as_ref()?.group.clone();
        let is_chosen = move |own: &str| group.as_deref().is_none_or(|group| group == own);
        let rows = rows.into_iter().filter(move |row| is_chosen(&row.group));
        Some((path, rows.collect::<Vec<_>>()))
    };
    if let (Some((_, calibrated)), Some((path, own))) = (values(calibration), values(held_out)) {
        for specimen in &own {
            let is_same = calibrated
                .iter()
                .any(|other| other.id == specimen.id && other.values == specimen.values);
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
