//! What can end the program before its work is done.

use std::path::Path;

use models::{SlurmError, WorkflowError};

/// What ends the program.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error(transparent)]
    Workflow(#[from] WorkflowError),
    #[error(transparent)]
    Slurm(#[from] SlurmError),
}

pub(super) fn file_error(path: &Path, source: std::io::Error) -> WorkflowError {
    WorkflowError::Io { path: path.to_owned(), source }
}
