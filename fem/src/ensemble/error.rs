//! Why an ensemble cannot go on. A run that fails is no such reason.

use std::io;
use std::path::{Path, PathBuf};

/// Why an ensemble cannot be opened or carried on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EnsembleError {
    /// The directory holds the runs of another ensemble.
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
    /// The ensemble's manifest cannot be understood.
    #[error(
        "{} is no manifest of an ensemble: {source}; take another directory, or delete this one to \
         start anew",
        path.display()
    )]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The directory was made by a version that writes other files.
    #[error(
        "{} has format {found}, not {expected}; take another directory, or delete this one to start \
         anew",
        path.display()
    )]
    Format {
        /// The manifest.
        path: PathBuf,
        /// The format of the files there.
        found: u32,
        /// The format that this version reads.
        expected: u32,
    },
    /// A stored run was made from other inputs than are asked for now.
    #[error(
        "run {id} in {} was made with {stored}, but {asked} is asked for; take another directory \
         for another design",
        path.display()
    )]
    OtherInputs {
        /// Number of the run.
        id: usize,
        /// Its file.
        path: PathBuf,
        /// Names and values it was made from.
        stored: String,
        /// Names and values asked for.
        asked: String,
    },
    /// A stored run whose checksum is missing or does not match its content.
    #[error(
        "{} was changed after run {id} was recorded ({reason}), so it is neither used nor replaced: restore the \
         file, or move it out of the directory to make the run again",
        path.display()
    )]
    Edited {
        /// Number of the run.
        id: usize,
        /// Its file.
        path: PathBuf,
        /// How checksum and content differ.
        reason: String,
    },
    /// A run that cannot be what was meant.
    #[error("run {id}: {message}")]
    Run {
        /// Number of the run.
        id: usize,
        /// What is wrong, and what to do about it.
        message: String,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}; ask for fewer")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        source: rayon::ThreadPoolBuildError,
    },
    /// A run, or the manifest, cannot be written: a full disk, a quota.
    #[error(
        "cannot write {}: {source}; what was finished before is kept: make room, and the same command \
         goes on from there",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// The file system refuses a lock.
    #[error(
        "cannot lock {}: {source}; processes that share an ensemble need locks that all machines see \
         (a local disk, NFS with its lock service, Lustre mounted with flock): take a directory there",
        path.display()
    )]
    Lock {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
    /// A file that cannot be read or made.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

impl EnsembleError {
    pub(super) fn io(action: &'static str, path: &Path, source: io::Error) -> EnsembleError {
        EnsembleError::Io { action, path: path.into(), source }
    }
}
