//! What can end a stage.

use std::path::{Path, PathBuf};

use fem::{CampaignError, FemError, LatticeError, MeshError, PackingError};
use surrogate::SurrogateError;

use crate::error::InputError;
use crate::fracture::CalibrationError;

/// Why a stage of the workflow ended before it was done.
#[derive(Debug, thiserror::Error)]
pub enum WorkflowError {
    /// A file that a person wrote is wrong.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A file cannot be read or written.
    #[error("{}: {message}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What happened and what to do.
        message: String,
    },
    /// The stage before has not been run.
    #[error("{} is not there: run `breccia {stage}` first, or `breccia run` for all stages", path.display())]
    Missing {
        /// The file that is needed.
        path: PathBuf,
        /// The stage that writes it.
        stage: &'static str,
    },
    /// The mesh is not usable.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The lattice cannot be built.
    #[error("{}: specimen: {source}", file.display())]
    Lattice {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: LatticeError,
    },
    /// The grains do not fit.
    #[error("{}: specimen.grains: {source}", file.display())]
    Packing {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: PackingError,
    },
    /// The case's test cannot be set up.
    #[error("{}: {source}", file.display())]
    Test {
        /// The case.
        file: PathBuf,
        /// What is wrong.
        source: FemError,
    },
    /// A simulation has failed on its way, or its curve cannot be written.
    #[error(transparent)]
    Fem(#[from] FemError),
    /// A campaign of simulations cannot go on.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The surrogate cannot be fitted, read or evaluated.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The posterior cannot be sampled.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// A result that the next stage cannot use.
    #[error("{0}")]
    Unusable(String),
    /// Ctrl-C.
    #[error("interrupted; what is finished is kept, and the same command goes on from there")]
    Interrupted,
}

impl WorkflowError {
    pub(crate) fn io(path: &Path, error: &std::io::Error) -> Self {
        Self::File { path: path.to_owned(), message: error.to_string() }
    }

    /// The folder of the results cannot be made.
    pub(crate) fn results(path: &Path, error: &std::io::Error) -> Self {
        let message = format!("cannot be made ({error}); name another folder with --out");
        Self::File { path: path.to_owned(), message }
    }
}
