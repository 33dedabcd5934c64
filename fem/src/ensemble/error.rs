//! Errors of an ensemble. The failure of a single run is not an error of the ensemble.

use std::io;
use std::path::{Path, PathBuf};

/// Why an ensemble cannot be opened or continued.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleError {
    /// The directory contains the runs of another ensemble.
    #[error(
        "{} holds the runs of another ensemble ({difference}); take another directory, or set back \
         what was changed",
        directory.display()
    )]
    Foreign {
        /// The ensemble's directory.
        directory: PathBuf,
        /// The lines of the fingerprints that differ.
        difference: String,
    },
    /// The manifest of the ensemble is malformed.
    #[error(
        "{} is no manifest of an ensemble: {source}; take another directory, or delete this one to \
         start anew",
        path.display()
    )]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// The error of the JSON parser.
        source: serde_json::Error,
    },
    /// The files in the directory have a format that this version does not read.
    #[error(
        "{} has format {found}, not {expected}; take another directory, or delete this one to start \
         anew",
        path.display()
    )]
    Format {
        /// The manifest.
        path: PathBuf,
        /// The format of the files in the directory.
        found: u32,
        /// The format that this version writes.
        expected: u32,
    },
    /// A stored run has other inputs than the requested run.
    #[error(
        "run {id} in {} was made with {stored}, but {asked} is asked for; take another directory \
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
        "{} was changed after run {id} was recorded ({reason}), so it is neither used nor replaced: restore the \
         file, or move it out of the directory to make the run again",
        path.display()
    )]
    Edited {
        /// Number of the run.
        id: usize,
        /// The file of the run.
        path: PathBuf,
        /// How checksum and content differ.
        reason: String,
    },
    /// The input of a run is invalid.
    #[error("run {id}: {message}")]
    Run {
        /// Number of the run.
        id: usize,
        /// What is wrong, and how to fix it.
        message: String,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}; ask for fewer")]
    Threads {
        /// The requested number of threads.
        threads: usize,
        /// The error of the thread pool.
        source: rayon::ThreadPoolBuildError,
    },
    /// A run or the manifest cannot be written, for example because the disk is full.
    #[error(
        "cannot write {}: {source}; what was finished before is kept: make room, and the same command \
         goes on from there",
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
        "cannot lock {}: {source}; processes that share an ensemble need locks that all machines see \
         (a local disk, NFS with its lock service, Lustre mounted with flock): take a directory there",
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
