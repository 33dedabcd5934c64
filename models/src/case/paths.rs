//! Paths of the files that a case names.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::plastic::hardening_key;
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
const LISTS: [&str; 2] = ["specimen.image.further_stacks", "simulator.files"];

/// Key of the program of `[simulator]`, the first entry of a list.
pub(crate) const PROGRAM: &str = "simulator.command";

/// Lists of a case whose entries have keys of a case in their table `set`.
const OVERLAYS: [&str; 3] = ["further_tests.candidate", "tests", "validation"];

/// Calls `visit` for each path in the table of a case, with its key: the paths of [`FILES`], of lists, of the program of
/// `[simulator]`, of time tables and tables of yield stresses, and of the keys of candidates, tests and validations. All functions that need
/// the files of a case use this function, so that no file is missing in one of them.
pub(crate) fn visit_paths(table: &mut Table, visit: &mut dyn FnMut(&str, &mut String)) {
    visit_below(table, "", visit);
}

fn visit_below(table: &mut Table, prefix: &str, visit: &mut dyn FnMut(&str, &mut String)) {
    let mut visit_value = |key: &str, value: Option<&mut Value>| {
        if let Some(Value::String(path)) = value {
            visit(&format!("{prefix}{key}"), path);
        }
    };
    for key in FILES {
        visit_value(key, at(table, key));
    }
    for list in LISTS {
        for file in at(table, list).and_then(Value::as_array_mut).into_iter().flatten() {
            visit_value(list, Some(file));
        }
    }
    let program = at(table, PROGRAM).and_then(|command| command.get_mut(0));
    // a program without a folder is searched in PATH
    let has_folder = |program_path: &str| Path::new(program_path).components().count() > 1;
    if program.as_ref().and_then(|program_path| program_path.as_str()).is_some_and(has_folder) {
        visit_value(PROGRAM, program);
    }
    let conditions = table.get_mut("conditions").and_then(Value::as_table_mut);
    for (key, value) in conditions.into_iter().flatten() {
        match value {
            Value::Array(entries) if key != "table" => {
                let key = format!("conditions.{key}.table");
                entries.iter_mut().for_each(|entry| visit_value(&key, entry.get_mut("table")));
            }
            value if key == "table" => visit_value("conditions.table", Some(value)),
            _ => {}
        }
    }
    let materials = table.get_mut("material").and_then(Value::as_table_mut);
    for (region, material) in materials.into_iter().flatten() {
        let path = ["plastic", "hardening", "table"];
        let file = path.iter().try_fold(material, |value, key| value.get_mut(key));
        visit_value(&hardening_key(region), file);
    }
    for list in OVERLAYS {
        for entry in at(table, list).and_then(Value::as_array_mut).into_iter().flatten() {
            let name = entry.get("name").and_then(Value::as_str).unwrap_or_default();
            let prefix = format!("{prefix}{list} ({name}).set.");
            if let Some(Value::Table(set)) = entry.get_mut("set") {
                visit_below(set, &prefix, visit);
            }
        }
    }
}

/// Value at a dotted path.
fn at<'a>(table: &'a mut Table, path: &str) -> Option<&'a mut Value> {
    let mut keys = path.split('.');
    let first = keys.next().and_then(|key| table.get_mut(key));
    keys.fold(first, |value, key| value?.get_mut(key))
}

/// Makes all paths in the table of a case absolute; relative paths refer to the folder of the file `case`.
pub(crate) fn make_absolute(table: &mut Table, case: &Path) {
    visit_paths(table, &mut |_, path| {
        let beside = case.with_file_name("").join(&*path);
        let absolute = std::path::absolute(&beside).unwrap_or(beside);
        *path = absolute.to_string_lossy().into_owned();
    });
}

/// All files and folders that a case names, with their keys. Relative paths refer to the folder of the case.
pub(crate) fn named_paths(file: &CaseFile) -> Vec<(String, PathBuf)> {
    let mut named = file.table_files.clone();
    let Ok(mut table) = Table::try_from(&file.case) else { return named };
    visit_paths(&mut table, &mut |key, path| {
        named.push((key.to_owned(), file.beside(Path::new(path))));
    });
    named
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

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";

    /// Every file in the keys of candidates, tests and validations is listed, and made absolute.
    #[test]
    fn files_in_every_key_of_an_overlay_are_listed() {
        let keys = FILES.map(|key| (key.to_owned(), "\"own\""));
        let lists = LISTS.map(|key| (key.to_owned(), "[\"own\"]"));
        let others = [
            (hardening_key("matrix"), "\"own\""),
            ("simulator.command".to_owned(), "[\"./own\", \"argument\"]"),
        ];
        for (key, value) in keys.into_iter().chain(lists).chain(others) {
            for list in OVERLAYS {
                let text = format!("{CASE}[[{list}]]\nname = \"slow\"\nset.{key} = {value}\n");
                let (file, _) = CaseFile::parse_all(&text, Path::new("folder/case.toml"));
                let named = named_paths(&file.unwrap());
                let (named_key, path) = named.first().unwrap_or_else(|| panic!("{list}: {key}"));
                assert_eq!(*named_key, format!("{list} (slow).set.{key}"));
                assert!(path.starts_with("folder") && path.ends_with("own"), "{path:?}");
                assert_eq!(named.len(), 1, "{named:?}");
            }
        }
    }
}
