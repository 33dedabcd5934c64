//! Errors of an ensemble. The failure of a single run is not an error of the ensemble.

use std::io;
use std::path::{Path, PathBuf};

/// Reason why an ensemble cannot be opened or continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleError {
    /// The directory contains the runs of another ensemble.
    #[error(
        "{} contains the runs of another ensemble ({difference}); use another directory, or undo the \
         change of these settings",
        directory.display()
    )]
    Foreign {
        /// The ensemble's directory.
        directory: PathBuf,
        /// The lines in which the two fingerprints differ.
        difference: String,
    },
    /// The manifest of the ensemble is malformed.
    #[error(
        "{} is not the manifest of an ensemble: {source}; use another directory, or delete this directory \
         to compute all runs again",
        path.display()
    )]
    Manifest {
        /// Path of the manifest.
        path: PathBuf,
        /// The error of the JSON parser.
        source: serde_json::Error,
    },
    /// The files in the directory have a format that this version does not read.
    #[error(
        "{} has format {found}, but this version reads formats up to {expected}; use another directory, or \
         delete this directory to compute all runs again",
        path.display()
    )]
    Format {
        /// Path of the manifest.
        path: PathBuf,
        /// The format of the files in the directory.
        found: u32,
        /// The format that this version writes.
        expected: u32,
    },
    /// A stored run has other inputs than the requested run.
    #[error(
        "run {id} in {} was computed with {stored}, but {asked} is requested; use another directory \
         for another design",
        path.display()
    )]
    OtherInputs {
        /// Number of the run.
        id: usize,
        /// The file of the run.
        path: PathBuf,
        /// Names and values of the stored inputs.
        stored: String,
        /// Names and values of the requested inputs.
        asked: String,
    },
    /// The checksum of a stored run is missing or does not match its content.
    #[error(
        "{} was changed after run {id} was recorded ({reason}), so the file is neither used nor replaced: restore \
         the file, or move it out of the directory to compute the run again",
        path.display()
    )]
    Edited {
        /// Number of the run.
        id: usize,
        /// The file of the run.
        path: PathBuf,
        /// Fault of the checksum: the checksum is missing, or differs from the checksum of the
        /// content.
        reason: String,
    },
    /// The input of a run is invalid, or the curve of a failed run is requested.
    #[error("run {id}: {message}")]
    Run {
        /// Number of the run.
        id: usize,
        /// The problem, and its remedy if there is one.
        message: String,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}; request fewer threads")]
    Threads {
        /// The requested number of threads.
        threads: usize,
        /// The error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
    /// A run or the manifest cannot be written, for example because the disk is full.
    #[error(
        "cannot write {}: {source}; finished runs are not lost: free disk space and repeat the command to \
         resume",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file system does not support locks.
    #[error(
        "cannot lock {}: {source}; processes that share an ensemble need file locks that are visible on all \
         machines: use a directory on a local disk, on NFS with its lock service, or on Lustre mounted with flock",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// A file cannot be read or created.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The action that failed.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
}

impl EnsembleError {
    pub(super) fn io(action: &'static str, path: &Path, source: io::Error) -> EnsembleError {
        EnsembleError::Io { action, path: path.into(), source }
    }
}
