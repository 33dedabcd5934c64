//! The base case of a study, and the cases that are derived from it by changes of keys.

use std::path::Path;

use toml::Table;

use crate::case::{CaseFile, make_absolute, merge, remove};
use crate::error::InputError;

/// The base case as written in the file, without defaults, because defaults may depend on the changed keys.
pub(super) struct Base(Table);

impl Base {
    /// Reads the base case that a study names, and makes its paths absolute. Returns all mistakes in the case. Returns
    /// no base if the file cannot be read, is not TOML or is a study.
    pub(super) fn read(study: &Path, base: &Path) -> (Option<Self>, Vec<InputError>) {
        let path = study.with_file_name("").join(base);
        let text = match CaseFile::text(&path) {
            Ok(text) => text,
            Err(mistake) => return (None, vec![mistake]),
        };
        let (_, mistakes) = CaseFile::parse_all(&text, &path);
        let written = text.parse().ok().filter(|_| !CaseFile::is_study(&text));
        let Some(mut written): Option<Table> = written else { return (None, mistakes) };
        if written.contains_key("tests") {
            let help = "Give each test a case of the study, or run the case with breccia run.";
            let problem = "has several tests, and a study compares cases with one test";
            return (None, vec![InputError::new(&path, "tests", "", problem, help)]);
        }
        make_absolute(&mut written, &path);
        (Some(Self(written)), mistakes)
    }

    /// Returns a part of the study as a complete case: the base case without the keys `without` and with the keys
    /// `sets`. Returns all mistakes; returns no case if a required key is missing or invalid.
    pub(super) fn with<'t>(
        &self,
        study: &Path,
        without: &[String],
        sets: impl IntoIterator<Item = &'t Table>,
    ) -> (Option<CaseFile>, Vec<InputError>) {
        let (mut table, mut mistakes) = (self.0.clone(), Vec::new());
        for key in without {
            if !remove(&mut table, key) {
                let help = "Name keys of the base case by their paths.";
                let problem = "is not in the base case";
                mistakes.push(InputError::new(study, "without", key, problem, help));
            }
        }
        sets.into_iter().for_each(|set| merge(&mut table, set));
        let (file, of_case) = CaseFile::parse_all(&table.to_string(), study);
        // line numbers of the merged text are not line numbers of the user's file
        mistakes.extend(of_case.into_iter().map(|error| InputError { excerpt: None, ..error }));
        (file, mistakes)
    }
}

/// Parses a key with its value from the command line.
///
/// # Errors
/// If the entry is not valid TOML.
pub(super) fn parsed(entry: &str, study: &Path) -> Result<Table, InputError> {
    entry.parse().map_err(|_| {
        let help = "Write a key by its path and a value of TOML, as --set specimen.spacing_mm=0.3.";
        InputError::new(study, "--set", entry, "is not a key with a value", help)
    })
}

#[cfg(test)]
mod tests {
    use toml::Value;

    use super::*;
    use crate::case::FILES;

    /// A case of a study is in another folder than its base case. Paths of the base case become absolute, including the
    /// paths of candidate tests.
    #[test]
    fn what_the_base_names_lies_beside_the_base() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("cases");
        std::fs::create_dir(&folder).unwrap();
        let candidate = "[[further_tests.candidate]]\nname = \"notched\"\nset.specimen = { mesh = \"notched.msh\", \
            regions = { matrix = 1 }, surfaces = { bottom = 2, top = 3 } }\n";
        let text = format!("{}\n{candidate}", crate::case::Case::TEMPLATE);
        std::fs::write(folder.join("base.toml"), text).unwrap();
        std::fs::write(folder.join("notched.msh"), "").unwrap();
        let study = dir.path().join("study.toml");
        let (base, mistakes) = Base::read(&study, Path::new("cases/base.toml"));
        assert_eq!(mistakes, []);
        let (file, mistakes) = base.unwrap().with(&study, &[], []);
        assert_eq!(mistakes, []);
        let file = file.unwrap();
        let candidates = file.case.further_tests.candidate;
        let mesh = candidates.iter().find_map(|candidate| candidate.mesh()).unwrap();
        assert_eq!(Path::new(mesh), std::path::absolute(folder.join("notched.msh")).unwrap());
    }

    /// Files in the keys of candidates and tests lie beside the file that names them, like the files of a case itself.
    #[test]
    fn files_in_overlays_lie_beside_the_file_that_names_them() {
        let case = Path::new("cases/base.toml");
        let expected = std::path::absolute("cases/own").unwrap();
        for list in ["further_tests.candidate", "tests"] {
            for key in FILES.into_iter().chain(["material.matrix.plastic.hardening.table"]) {
                let mut table: Table =
                    format!("[[{list}]]\nname = \"a\"\nset.{key} = \"own\"\n").parse().unwrap();
                make_absolute(&mut table, case);
                let table = Value::Table(table);
                let entries = list.split('.').fold(&table, |value, key| &value[key]);
                let named = key.split('.').fold(&entries[0]["set"], |value, key| &value[key]);
                assert_eq!(named.as_str().map(Path::new), Some(&*expected), "{list}: {key}");
            }
        }
    }

    #[test]
    fn each_file_of_the_base_is_named_from_anywhere() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("cases")).unwrap();
        let expected = std::path::absolute(dir.path().join("cases/own")).unwrap();
        for key in FILES {
            let text = format!("{key} = \"own\"\n");
            std::fs::write(dir.path().join("cases/base.toml"), text).unwrap();
            let study = dir.path().join("study.toml");
            let base = Base::read(&study, Path::new("cases/base.toml")).0.unwrap();
            let table = Value::Table(base.0);
            let named = key.split('.').fold(&table, |value, key| &value[key]);
            assert_eq!(named.as_str().map(Path::new), Some(&*expected), "{key}");
        }
        let text = "simulator = { command = [\"./own\", \"own\"], files = [\"own\"] }\n";
        std::fs::write(dir.path().join("cases/base.toml"), text).unwrap();
        let base = Base::read(&dir.path().join("study.toml"), Path::new("cases/base.toml")).0;
        let simulator = &base.unwrap().0["simulator"];
        let named = [&simulator["command"][0], &simulator["command"][1], &simulator["files"][0]];
        let resolved = Some(&*expected);
        assert_eq!(
            named.map(|entry| entry.as_str().map(Path::new)),
            [resolved, Some(Path::new("own")), resolved]
        );
    }
}
