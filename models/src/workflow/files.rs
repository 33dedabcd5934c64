//! The files of the results.

use std::path::Path;

use super::WorkflowError;

/// The table of the specimens, measured or virtual.
pub(super) const SPECIMENS: &str = "experiments/specimens.csv";

/// Writes a file whole or not at all; its folder is made.
pub(super) fn write(path: &Path, content: &[u8]) -> Result<(), WorkflowError> {
    path.parent()
        .map_or(Ok(()), std::fs::create_dir_all)
        .and_then(|()| fem::write_atomically(path, content))
        .map_err(|e| WorkflowError::io(path, e))
}

/// Whether two paths lead to one file.
pub(super) fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
