//! The identity of runs: the keys of the case and the files on which their results depend.

use std::fmt;

use super::inputs::Inputs;
use crate::results_folder::content_hash::ContentHash;

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

    /// Key of runs that also depend on these keys of the case and these files.
    pub(crate) fn and(&self, inputs: &Inputs<'_>, keys: &[&str], files: &[&str]) -> Self {
        self.with(&inputs.fingerprints(keys, files))
    }

    /// Key of runs that also depend on what `text` describes. A line of the text ends with a line break.
    pub(crate) fn with(&self, text: &str) -> Self {
        Self(format!("{}{text}", self.0))
    }

    /// Names of the keys of the case and of the files in the key.
    #[cfg(test)]
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.0.lines().filter_map(|line| line.split_once(" = ")).map(|(name, _)| name)
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
