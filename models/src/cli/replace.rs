//! Files of the user that a command may replace.

use std::path::{Path, PathBuf};

use crate::{InputError, WorkflowError};

/// Returns the absolute paths of the files given with `--replace`. Each name is relative to the results folder or to
/// the current folder.
///
/// # Errors
/// If there is no file with this name.
pub(super) fn replaceable(out: &Path, named: &[PathBuf]) -> Result<Vec<PathBuf>, WorkflowError> {
    let absolute = |path: &Path| {
        std::path::absolute(path)
            .map_err(|source| WorkflowError::Io { path: path.to_owned(), source })
    };
    let existing_path = |name: &PathBuf| {
        let places = [absolute(&out.join(name))?, absolute(name)?];
        let existing = places.into_iter().find(|path| path.symlink_metadata().is_ok());
        existing.ok_or_else(|| {
            let help = format!("Name a file within {}.", out.display());
            let name = name.display().to_string();
            InputError::new(Path::new("--replace"), name, "", "there is no such file", help).into()
        })
    };
    named.iter().map(existing_path).collect()
}
