//! The base case of a study, and the cases that come of it by other keys.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::case::{CaseFile, merge, remove};
use crate::error::InputError;

/// The base case as it is written: its defaults may depend on what is set.
pub(super) struct Base(Table);

impl Base {
    /// Reads the case that a study names; what it names itself is then found from anywhere.
    ///
    /// # Errors
    /// A case that cannot be read or is none.
    pub(super) fn read(study: &Path, base: &Path) -> Result<Self, InputError> {
        let path = study.with_file_name("").join(base);
        let file = CaseFile::read(&path)?;
        let text = fem::read_regular_text(&path)
            .map_err(|e| InputError::unreadable(&path, &e, "Check its name and place."))?;
        let mut written: Table = text.parse().map_err(|e: toml::de::Error| {
            InputError::new(&path, "", "", e.message(), "See the base case.")
        })?;
        for key in ["specimen.mesh", "specimen.image.stack", "experiments.table"] {
            let mut keys = key.split('.');
            let first = keys.next().and_then(|key| written.get_mut(key));
            absolute(&file, keys.fold(first, |value, key| value?.get_mut(key)));
        }
        let images = ["specimen", "image", "further_stacks"];
        let first = written.get_mut(images[0]);
        let images = images[1..].iter().fold(first, |value, key| value?.get_mut(key));
        for image in images.and_then(Value::as_array_mut).into_iter().flatten() {
            absolute(&file, Some(image));
        }
        let further = written.get_mut("further_tests").and_then(|table| table.get_mut("candidate"));
        for candidate in further.and_then(Value::as_array_mut).into_iter().flatten() {
            let mesh = ["set", "specimen", "mesh"];
            absolute(&file, mesh.iter().try_fold(candidate, |value, key| value.get_mut(key)));
        }
        Ok(Self(written))
    }

    /// A part of the study as a case of its own: the base without some keys, with others.
    ///
    /// # Errors
    /// A key that is not in the base; a case that is none.
    pub(super) fn with<'t>(
        &self,
        study: &Path,
        part: &str,
        without: &[String],
        sets: impl IntoIterator<Item = &'t Table>,
    ) -> Result<CaseFile, InputError> {
        let mut table = self.0.clone();
        for key in without {
            if !remove(&mut table, key) {
                let help = "Name keys of the base case by their paths.";
                let place = format!("{part}.without");
                return Err(InputError::new(study, place, key, "is not in the base case", help));
            }
        }
        sets.into_iter().for_each(|set| merge(&mut table, set));
        CaseFile::parse(&table.to_string(), study).map_err(|error| {
            // a line of the merged text is none of the file
            let place =
                match error.place.strip_prefix("line ").and_then(|rest| rest.split_once(", ")) {
                    Some((_, key)) => key.to_owned(),
                    None => error.place,
                };
            InputError { place: format!("{part}: {place}"), ..error }
        })
    }
}

/// Makes a path beside the case one from anywhere.
fn absolute(file: &CaseFile, named: Option<&mut Value>) {
    if let Some(Value::String(named)) = named {
        let beside = file.beside(&PathBuf::from(&*named));
        let path = std::path::absolute(&beside).unwrap_or(beside);
        *named = path.to_string_lossy().into_owned();
    }
}

/// A key with its value, from the command line.
///
/// # Errors
/// What is no TOML.
pub(super) fn parsed(entry: &str, study: &Path) -> Result<Table, InputError> {
    entry.parse().map_err(|_| {
        let help = "Write a key by its path and a value of TOML, as --set specimen.spacing_mm=0.3.";
        InputError::new(study, "--set", entry, "is no key with a value", help)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A case of a study lies in another folder than its base: files are named from anywhere, those of
    /// further tests too.
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
        let base = Base::read(&study, Path::new("cases/base.toml")).unwrap();
        let file = base.with(&study, "a", &[], []).unwrap();
        let candidates = file.case.further_tests.candidate;
        let mesh = candidates.iter().find_map(|candidate| candidate.mesh()).unwrap();
        assert_eq!(Path::new(mesh), std::path::absolute(folder.join("notched.msh")).unwrap());
    }
}
