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

/// Makes all paths in the table of a case absolute; relative paths refer to the folder of the file `case`.
pub(crate) fn make_absolute(table: &mut Table, case: &Path) {
    for key in FILES {
        let mut keys = key.split('.');
        let first = keys.next().and_then(|key| table.get_mut(key));
        absolute(case, keys.fold(first, |value, key| value?.get_mut(key)));
    }
    for list in [&["specimen", "image", "further_stacks"][..], &["simulator", "files"]] {
        let first = table.get_mut(list[0]);
        let files = list[1..].iter().fold(first, |value, key| value?.get_mut(key));
        for file in files.and_then(Value::as_array_mut).into_iter().flatten() {
            absolute(case, Some(file));
        }
    }
    let command = table.get_mut("simulator").and_then(|table| table.get_mut("command"));
    let program = command.and_then(|command| command.get_mut(0));
    // a program without a folder is searched in PATH
    let has_folder = |own: &str| Path::new(own).components().count() > 1;
    if program.as_ref().and_then(|own| own.as_str()).is_some_and(has_folder) {
        absolute(case, program);
    }
    let conditions = table.get_mut("conditions").and_then(Value::as_table_mut);
    for (key, value) in conditions.into_iter().flatten() {
        match value {
            Value::Array(entries) if key != "table" => {
                entries.iter_mut().for_each(|entry| absolute(case, entry.get_mut("table")));
            }
            value if key == "table" => absolute(case, Some(value)),
            _ => {}
        }
    }
    let materials = table.get_mut("material").and_then(Value::as_table_mut);
    for (_, material) in materials.into_iter().flatten() {
        let path = ["plastic", "hardening", "table"];
        absolute(case, path.iter().try_fold(material, |value, key| value.get_mut(key)));
    }
    let further = table.get_mut("further_tests").and_then(|table| table.get_mut("candidate"));
    make_overlays_absolute(further, case);
    for list in ["tests", "validation"] {
        make_overlays_absolute(table.get_mut(list), case);
    }
}

/// Makes all paths in the table `set` of each entry of a list absolute.
fn make_overlays_absolute(list: Option<&mut Value>, case: &Path) {
    for entry in list.and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(Value::Table(set)) = entry.get_mut("set") {
            make_absolute(set, case);
        }
    }
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

/// The validations of a case with absolute paths. The format of the files of `[experiments]` becomes a key of each
/// validation with its own table of specimens, because copies of the other files have another format.
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
    let read = file.case.experiments.as_ref().and_then(|own| own.read.as_ref());
    let read = read.and_then(|read| Value::try_from(read).ok());
    for entry in &mut entries {
        let experiments = entry.set.get_mut("experiments").and_then(Value::as_table_mut);
        if let (Some(own), Some(read)) = (experiments, &read)
            && own.contains_key("table")
            && !own.contains_key("read")
        {
            own.insert("read".to_owned(), read.clone());
        }
    }
    Ok(entries)
}

/// Makes a path absolute; a relative path refers to the folder of the case.
fn absolute(case: &Path, named: Option<&mut Value>) {
    if let Some(Value::String(named)) = named {
        let beside = case.with_file_name("").join(&*named);
        let path = std::path::absolute(&beside).unwrap_or(beside);
        *named = path.to_string_lossy().into_owned();
    }
}
