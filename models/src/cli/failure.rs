//! Errors that end the program.

use std::path::Path;

use crate::WorkflowError;
use crate::study::SlurmError;

/// Error that ends the program.
#[derive(Debug, thiserror::Error)]
pub(super) enum Failure {
    #[error(transparent)]
    Workflow(#[from] WorkflowError),
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    #[error("standard output cannot be written ({0}); the results are in the results folder")]
    Output(std::io::Error),
    #[cfg(feature = "mpi")]
    #[error(transparent)]
    Mpi(#[from] fem_mpi::MpiError),
    #[cfg(not(feature = "mpi"))]
    #[error(
        "{0} processes were started together, but this program was built without MPI, so that each process would do the \
         same: build the program with --features mpi, or start one process"
    )]
    WithoutMpi(usize),
    #[error(
        "{count} processes were started together, but only `simulate` can run on several processes, and each process would \
         {command} the same: start one process, or see `breccia help ensemble` for jobs"
    )]
    NotShared { command: String, count: usize },
}

pub(super) fn file_error(path: &Path, source: std::io::Error) -> WorkflowError {
    WorkflowError::Io { path: path.to_owned(), source }
}
