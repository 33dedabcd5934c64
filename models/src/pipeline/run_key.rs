//! The identity of runs: the keys of the case and the files on which their results depend.

use std::fmt;

use super::inputs::Inputs;
use crate::results_folder::content_hash::ContentHash;
use crate::results_folder::error::WorkflowError;

/// Keys of the case that define a simulation on a given mesh.
const SIMULATION: [&str; 8] = [
    "specimen.order",
    "specimen.homogenisation",
    "material",
    "interface",
    "phase_field",
    "test",
    "conditions",
    "solver",
];

/// Identity of runs. Its text has a line `name = fingerprint` for each key of the case and each file on which the runs
/// depend, and lines for what the case does not state, such as a mesh level. Runs with the same key and the same inputs
/// have the same results, if the same version of the program makes them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RunKey(String);

impl RunKey {
    /// Key of runs that depend on these keys of the case and these files. The running stage then depends on them, too.
    pub(crate) fn new(inputs: &Inputs<'_>, keys: &[&str], files: &[&str]) -> Self {
        Self(inputs.fingerprints(keys, files))
    }

    /// Key of simulations that depend on `further` keys and on `files`, for example on files of meshes.
    pub(crate) fn of_simulations(inputs: &Inputs<'_>, further: &[&str], files: &[&str]) -> Self {
        Self::new(inputs, &[&SIMULATION[..], further].concat(), files)
    }

    /// Key of runs that also depend on these keys of the case and these files.
    pub(crate) fn and(&self, inputs: &Inputs<'_>, keys: &[&str], files: &[&str]) -> Self {
        self.with(&inputs.fingerprints(keys, files))
    }

    /// Key of runs whose mesh is made from the specimen of the case.
    ///
    /// # Errors
    /// Fails for a specimen with wrong values.
    pub(crate) fn and_specimen(&self, inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        let file = inputs.geometry_file(&inputs.geometry()?);
        Ok(self.and(inputs, &["specimen"], &file.as_deref().into_iter().collect::<Vec<_>>()))
    }

    /// Key of runs that also depend on what `text` describes. A line of the text ends with a line break.
    pub(crate) fn with(&self, text: &str) -> Self {
        Self(format!("{}{text}", self.0))
    }

    /// Name of the folder of the runs: the hash of the text.
    pub(crate) fn folder_name(&self) -> String {
        ContentHash::of(&self.0).to_string()
    }
}

impl fmt::Display for RunKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::case::{Case, CaseFile};

    /// The key of runs does not depend on what the stage has read before, and changes with each of its parts.
    #[test]
    fn a_key_depends_on_its_parts_alone() {
        let dir = tempfile::tempdir().unwrap();
        let key = |text: &str, mesh: &str, reads_before: bool| {
            std::fs::write(dir.path().join("mesh.msh"), mesh).unwrap();
            let file = CaseFile::parse(text, Path::new("case.toml")).unwrap();
            let inputs = Inputs::new(&file, dir.path(), |_| None);
            if reads_before {
                inputs.calibration();
                inputs.reads_file("absent.csv");
            }
            RunKey::of_simulations(&inputs, &["design"], &["mesh.msh"])
        };
        let plain = key(Case::TEMPLATE, "a mesh", false);
        assert_eq!(key(Case::TEMPLATE, "a mesh", true), plain);
        assert_ne!(key(Case::TEMPLATE, "another mesh", false), plain);
        for (old, new, is_same) in [
            ("poisson = 0.25", "poisson = 0.3", false),
            ("displacement_mm = 0.22", "displacement_mm = 0.2", false),
            ("chains = 4", "chains = 5", true),
        ] {
            let text = Case::TEMPLATE.replacen(old, new, 1);
            assert_ne!(text, Case::TEMPLATE, "{old}");
            assert_eq!(key(&text, "a mesh", false) == plain, is_same, "{old}");
        }
        assert_ne!(plain.with("level = 1 mm\n").folder_name(), plain.folder_name());
    }
}
