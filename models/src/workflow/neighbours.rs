//! Folders of results that belong together, as those of a study do: what one has made from the same inputs
//! no other one makes again.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::files::same_file;
use super::inputs::Inputs;
use super::locks::lock;
use super::product_folder::ProductFolder;
use super::{InputInPlace, WorkflowError};

/// The file that names them, in the folder around them.
const FILE: &str = "study.toml";

/// The folders of a study, each by its path within it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Together {
    /// Where specimens are tested.
    pub(crate) laboratories: Vec<String>,
    /// Where parameters are calibrated.
    pub(crate) cases: Vec<String>,
}

impl Together {
    /// What a folder says of those in it, if it is one of a study.
    pub(crate) fn read(dir: &Path) -> Option<Self> {
        toml::from_str(&fem::read_regular_text(&dir.join(FILE)).ok()?).ok()
    }

    /// Refuses a folder for the results of a study in which the study itself has the name of this file.
    ///
    /// # Errors
    /// [`WorkflowError::InputInPlace`].
    pub(crate) fn check_study(study: &Path, dir: &Path) -> Result<(), WorkflowError> {
        match same_file(study, &dir.join(FILE)) {
            false => Ok(()),
            true => Err(WorkflowError::InputInPlace(Box::new(InputInPlace {
                case: study.to_owned(),
                key: "the study".to_owned(),
                input: study.to_owned(),
                product: FILE.to_owned(),
                dir: dir.to_owned(),
            }))),
        }
    }

    /// Writes it, unless it is there.
    ///
    /// # Errors
    /// A file of the user's in its place; a file that cannot be written.
    pub(crate) fn write(&self, dir: &Path, folder: &ProductFolder) -> Result<(), WorkflowError> {
        if Self::read(dir).as_ref() == Some(self) {
            return Ok(());
        }
        let text = toml::to_string(self).expect("names are plain text");
        folder.write(FILE, "study", text.as_bytes()).map(drop)
    }

    fn folders(&self) -> impl Iterator<Item = &String> {
        self.laboratories.iter().chain(&self.cases)
    }
}

/// How deep a folder lies in that of its study at most.
const DEPTH: usize = 3;

/// The folders that share with one of them.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    root: PathBuf,
    /// The others.
    pub(super) folders: Vec<PathBuf>,
}

impl Neighbours {
    /// Those of a folder, if it is named by a study around it.
    pub(super) fn of(dir: &Path) -> Option<Self> {
        let dir = std::path::absolute(dir).ok()?;
        dir.ancestors().skip(1).take(DEPTH).find_map(|root| {
            let together = Together::read(root)?;
            let is_own = |name: &&String| root.join(name) == dir;
            together.folders().find(is_own)?;
            let others = together.folders().filter(|name| !is_own(name));
            Some(Self {
                root: root.to_owned(),
                folders: others.map(|name| root.join(name)).collect(),
            })
        })
    }

    /// Waits until no neighbour with the same specimen is at a stage: it then takes over what was made there.
    ///
    /// # Errors
    /// As [`lock`].
    pub(super) fn lock(
        &self,
        stage: &'static str,
        inputs: &Inputs<'_>,
        interrupt: &AtomicBool,
    ) -> Result<File, WorkflowError> {
        let name = format!("{stage} of specimen {}", inputs.specimen());
        lock(&self.root, &name, stage, interrupt)
    }

    /// The folder around them.
    pub(super) fn root(&self) -> &Path {
        &self.root
    }

    /// Where they make the runs of this kind, which those that have the same inputs share.
    pub(super) fn runs(&self, kind: &str) -> PathBuf {
        self.root.join("runs").join(kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_those_that_the_study_around_a_folder_names() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        let names = |names: &[&str]| names.iter().map(|name| name.to_string()).collect();
        let together =
            Together { laboratories: names(&["laboratories/L"]), cases: names(&["a", "v/a"]) };
        together.write(root, &ProductFolder::new(root, &[])).unwrap();
        assert_eq!(Together::read(root), Some(together));
        let of = |name: &str| Neighbours::of(&root.join(name)).map(|found| found.folders);
        let at = |names: [&str; 2]| Some(names.map(|name| root.join(name)).to_vec());
        assert_eq!(of("a"), at(["laboratories/L", "v/a"]));
        assert_eq!(of("v/a"), at(["laboratories/L", "a"]));
        assert_eq!(of("laboratories/L"), at(["a", "v/a"]));
        assert_eq!(of("b"), None);
        assert_eq!(of("."), None);
    }
}
