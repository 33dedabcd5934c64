//! Paths of the files that a case names.

use std::path::Path;

use toml::{Table, Value};

use super::{Case, CaseFile, ValidationCase};
use crate::error::InputError;

/// Keys of a case whose values are files or folders.
pub(crate) const FILES: [&str; 9] = [
    "specimen.mesh",
    "specimen.stl.surfaces",
    "specimen.image.stack",
    "specimen.image.labels",
    "specimen.image.region.mask",
    "simulator.input",
    "design.import",
    "experiments.table",
    "experiments.values",
];

/// Keys of a case whose values are lists of files.
const FILE_LISTS: [&str; 2] = ["specimen.image.further_stacks", "simulator.files"];

/// Key of the program of `[simulator]`, the first entry of a list.
pub(crate) const PROGRAM: &str = "simulator.command";

/// Calls `visit` with the key and the value of each path in the table of a case. A path in the keys `set` of a
/// candidate, a test or a validation has the key that it has in a case.
pub(crate) fn visit_paths(table: &mut Table, visit: &mut dyn FnMut(&'static str, &mut String)) {
    for key in FILES {
        if let Some(Value::String(path)) = at_mut(table, key) {
            visit(key, path);
        }
    }
    for list in FILE_LISTS {
        for file in at_mut(table, list).and_then(Value::as_array_mut).into_iter().flatten() {
            if let Value::String(path) = file {
                visit(list, path);
            }
        }
    }
    // a program without a folder is searched in PATH
    let has_folder = |program: &str| Path::new(program).components().count() > 1;
    match at_mut(table, PROGRAM).and_then(|command| command.get_mut(0)) {
        Some(Value::String(program)) if has_folder(program) => visit(PROGRAM, program),
        _ => {}
    }
    let materials = table.get_mut("material").and_then(Value::as_table_mut);
    for (_, material) in materials.into_iter().flatten() {
        let keys = ["plastic", "hardening", "table"];
        let path = keys.iter().try_fold(material, |value, key| value.get_mut(key));
        if let Some(Value::String(path)) = path {
            visit("material.plastic.hardening.table", path);
        }
    }
    for list in ["further_tests.candidate", "tests", "validation"] {
        for entry in at_mut(table, list).and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(Value::Table(set)) = entry.get_mut("set") {
                visit_paths(set, visit);
            }
        }
    }
}

/// The value at a dotted path.
fn at_mut<'a>(table: &'a mut Table, path: &str) -> Option<&'a mut Value> {
    let mut keys = path.split('.');
    let first = keys.next().and_then(|key| table.get_mut(key));
    keys.fold(first, |value, key| value?.get_mut(key))
}

/// Makes all paths in the table of a case absolute; relative paths refer to the folder of the file `case`.
pub(crate) fn make_absolute(table: &mut Table, case: &Path) {
    visit_paths(table, &mut |_, path| *path = absolute(case, path));
}

/// The case with absolute paths.
///
/// # Errors
/// If the case cannot be written as TOML or read again.
pub(crate) fn with_absolute_paths(file: &CaseFile) -> Result<Case, InputError> {
    let refused = |e: String| InputError::new(&file.path, "", "", e, "See breccia init.");
    let mut table = Table::try_from(&file.case).map_err(|e| refused(e.to_string()))?;
    make_absolute(&mut table, &file.path);
    table.try_into().map_err(|e: toml::de::Error| refused(e.message().to_owned()))
}

/// The validations of a case with absolute paths. If a validation has its own table of specimens, the table
/// `[experiments.read]` of the case is copied to this validation: the copies of the case's curves have another format,
/// and the copied case therefore loses this table.
///
/// # Errors
/// If the case cannot be written as TOML or read again.
pub(crate) fn validations_with_absolute_paths(
    file: &CaseFile,
) -> Result<Vec<ValidationCase>, InputError> {
    if file.case.validation.is_empty() {
        return Ok(Vec::new());
    }
    let mut entries = with_absolute_paths(file)?.validation;
    let read = file.case.experiments.as_ref().and_then(|stated| stated.read.as_ref());
    let read = read.and_then(|read| Value::try_from(read).ok());
    for entry in &mut entries {
        let experiments = entry.set.get_mut("experiments").and_then(Value::as_table_mut);
        if let (Some(experiments_table), Some(read)) = (experiments, &read)
            && experiments_table.contains_key("table")
            && !experiments_table.contains_key("read")
        {
            experiments_table.insert("read".to_owned(), read.clone());
        }
    }
    Ok(entries)
}

/// Returns the absolute path of a file; a relative path refers to the folder of the case.
fn absolute(case: &Path, path: &str) -> String {
    let beside = case.with_file_name("").join(path);
    let path = std::path::absolute(&beside).unwrap_or(beside);
    path.to_string_lossy().into_owned()
}
