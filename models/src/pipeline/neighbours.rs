//! Results folders of one study: results are copied instead of computed if another folder of the study has computed
//! them from the same inputs.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};

use super::inputs::Inputs;
use crate::results_folder::error::{InputInPlace, WorkflowError};
use crate::results_folder::files::same_file;
use crate::results_folder::locks::lock;
use crate::results_folder::product_folder::ProductFolder;

/// File in the parent folder that lists the folders of a study.
const FILE: &str = "study.toml";

/// Paths of the results folders of a study, relative to the study's folder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Together {
    /// Folders in which specimens are tested.
    pub(crate) laboratories: Vec<String>,
    /// Folders in which parameters are calibrated.
    pub(crate) cases: Vec<String>,
}

impl Together {
    /// Reads the list of folders from the folder of a study; `None` if `dir` is not such a folder.
    pub(crate) fn read(dir: &Path) -> Option<Self> {
        toml::from_str(&fem::read_regular_text(&dir.join(FILE)).ok()?).ok()
    }

    /// Checks that the study file of the user is not `study.toml`, in which the program lists the folders of the study.
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

    /// Writes the list of folders to `study.toml`, unless the file already has this content.
    ///
    /// # Errors
    /// Fails if a file of the user has the path of `study.toml`, or if the file cannot be written.
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

/// Maximum depth of a results folder within the folder of its study.
const DEPTH: usize = 3;

/// The other folders of the study to which a results folder belongs.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    root: PathBuf,
    /// Paths of the folders of the other cases of the study.
    pub(crate) folders: Vec<PathBuf>,
}

impl Neighbours {
    /// Returns the neighbours of a folder; `None` unless a study in a parent folder lists this folder.
    pub(crate) fn of(dir: &Path) -> Option<Self> {
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

    /// Whether a study in a parent folder lists this folder as the folder of a case.
    pub(crate) fn is_case_of_study(dir: &Path) -> bool {
        let is_case = |root: &Path| {
            let cases = Together::read(root).map(|together| together.cases).unwrap_or_default();
            cases.iter().any(|name| root.join(name) == dir)
        };
        dir.ancestors().skip(1).take(DEPTH).any(is_case)
    }

    /// Waits until no neighbour with the same specimen is running the stage. Afterwards the products of the neighbours
    /// can be copied.
    ///
    /// # Errors
    /// The errors of [`lock`].
    pub(crate) fn lock(
        &self,
        stage: &'static str,
        inputs: &Inputs<'_>,
        interrupt: &AtomicBool,
    ) -> Result<File, WorkflowError> {
        let name = format!("{stage} of specimen {}", inputs.specimen());
        lock(&self.root, &name, stage, interrupt)
    }

    /// Folder of the study.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Folder of the runs of the given kind, which all neighbours with the same inputs share.
    pub(crate) fn runs(&self, kind: &str) -> PathBuf {
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
        let folders_of =
            |name: &str| Neighbours::of(&root.join(name)).map(|neighbours| neighbours.folders);
        let at = |names: [&str; 2]| Some(names.map(|name| root.join(name)).to_vec());
        assert_eq!(folders_of("a"), at(["laboratories/L", "v/a"]));
        assert_eq!(folders_of("v/a"), at(["laboratories/L", "a"]));
        assert_eq!(folders_of("laboratories/L"), at(["a", "v/a"]));
        assert_eq!(folders_of("b"), None);
        assert_eq!(folders_of("."), None);
    }
}
