//! Why a campaign cannot go on. A run that fails is no such reason.

use std::path::{Path, PathBuf};

/// Why a campaign cannot be opened or carried on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// The directory holds the runs of another campaign.
    #[error(
        "{} holds the runs of another campaign ({difference}); take another directory, or set back \
         what was changed",
        directory.display()
    )]
    Foreign {
        /// The campaign's directory.
        directory: PathBuf,
        /// The lines of the fingerprints that differ.
        difference: String,
    },
    /// The campaign's manifest cannot be understood.
    #[error(
        "{} is no manifest of a campaign: {message}; take another directory, or delete this one to \
         start anew",
        path.display()
    )]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        message: String,
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
    /// A run that cannot be what was meant.
    #[error("run {id}: {message}")]
    Run {
        /// Number of the run.
        id: usize,
        /// What is wrong, and the mend.
        message: String,
    },
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {message}; ask for fewer")]
    Threads {
        /// How many were asked for.
        threads: usize,
        /// What the system says.
        message: String,
    },
    /// A file that cannot be read or written.
    #[error("cannot {action} {}: {message}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        message: String,
    },
}

impl CampaignError {
    pub(super) fn io(action: &'static str, path: &Path, error: &std::io::Error) -> CampaignError {
        CampaignError::Io { action, path: path.into(), message: error.to_string() }
    }
}
