//! Errors of the creation of a problem and of a run, each with its remedy.

mod file;
mod step;
mod unsupported;

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fem_mesh::MeshError;

pub use file::{CheckpointError, CurveFileError};
pub use step::StepFailure;
pub use unsupported::Unsupported;

/// Error that prevents the creation of a problem or stops its run.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// The mesh is invalid.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A surface named by a condition is missing or empty.
    #[error(
        "the mesh has no triangles on surface '{name}', where {role}; its surfaces are {present}: name the surfaces when the mesh is built or read (a compression test needs 'bottom' and 'top')"
    )]
    MissingSurface {
        /// Name of the missing surface.
        name: String,
        /// Purpose of the surface in the condition, as a clause after "where".
        role: &'static str,
        /// Names of the existing surfaces.
        present: String,
    },
    /// The number of materials differs from the number of regions.
    #[error(
        "{materials} materials for {regions} regions ({names}): give one material to each region, in this order"
    )]
    MaterialCount {
        /// Number of materials.
        materials: usize,
        /// Number of regions of the mesh.
        regions: usize,
        /// Names of the regions.
        names: String,
    },
    /// A parameter is out of its range.
    #[error("{entity}: {field} = {value} must be {requirement}")]
    OutOfRange {
        /// Object to which the parameter belongs, such as "material.matrix".
        entity: String,
        /// Name of the parameter.
        field: &'static str,
        /// Value of the parameter.
        value: f64,
        /// Allowed values.
        requirement: &'static str,
    },
    /// A combination of settings is not supported.
    #[error("{entity}: {reason}; {}", reason.help())]
    Unsupported {
        /// The setting or object that is not supported, such as a material or a surface.
        entity: String,
        /// Reason; [`Unsupported::help`] is its remedy.
        reason: Unsupported,
    },
    /// The given fields belong to another problem.
    #[error(
        "the fields have {nodes} nodes, but the problem has {expected} nodes: use fields that this problem has computed"
    )]
    OtherFields {
        /// Number of nodes of the fields.
        nodes: usize,
        /// Number of nodes of the problem.
        expected: usize,
    },
    /// The given fields contain the state of the laws of another problem.
    #[error(
        "the fields have {values} state values of laws, but the problem has {expected} state values: use fields that this problem has computed"
    )]
    OtherState {
        /// Number of state values of the fields.
        values: usize,
        /// Number of state values of the problem.
        expected: usize,
    },
    /// The given fields invert an element, for which stress and energy do not exist.
    #[error(
        "the fields turn an element inside out, so that its stress is not defined: use the fields of an equilibrium"
    )]
    InvertedFields,
    /// No equilibrium was found, even with the smallest load step.
    #[error(
        "no equilibrium after {displacement_mm} mm ({time_s} s) with steps down to {step_s} s ({source}); {help}"
    )]
    NotConverged {
        /// Displacement of the last equilibrium, mm.
        displacement_mm: f64,
        /// Time of the last equilibrium, s.
        time_s: f64,
        /// Duration of the last attempted increment, s.
        step_s: f64,
        /// Reason for the failure of the last attempt.
        source: StepFailure,
        /// Advice how to change the problem so that an equilibrium is found.
        help: String,
    },
    /// The matrix could not be factorised in the available memory.
    #[error(
        "the sparse factorisation of {unknowns} unknowns failed: {source}; use a coarser mesh, a machine with more memory, or linear = \"multigrid\""
    )]
    Factorisation {
        /// Number of equations.
        unknowns: usize,
        /// Error of the factorisation.
        source: Arc<dyn Error + Send + Sync>,
    },
    /// A file cannot be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The action that failed: `read` or `write`.
        action: &'static str,
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: Arc<io::Error>,
    },
    /// A checkpoint file is invalid.
    #[error("{}: {source}", path.display())]
    Checkpoint {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the error.
        source: CheckpointError,
    },
    /// Another rank reported an error, for example because it could not write a file. All ranks then stop.
    #[error("rank {rank}: {message}")]
    Rank {
        /// Number of the rank.
        rank: usize,
        /// Error message of the rank.
        message: String,
    },
    /// Another rank has ended unexpectedly.
    #[error("the run stopped because rank {rank} has ended; {}", resumption(checkpoint.as_deref()))]
    RankLost {
        /// Number of the rank.
        rank: usize,
        /// Checkpoint file from which the run can resume, if its state was saved.
        checkpoint: Option<PathBuf>,
    },
    /// A simulation of another program failed.
    #[error("{0}")]
    OtherProgram(String),
    /// A run of an ensemble failed for a reason that every run shares, for example because its program cannot be started.
    /// The ensemble stops ([`EnsembleError::FailsInEveryRun`](crate::EnsembleError::FailsInEveryRun)) and does not record
    /// the failure.
    #[error("{0}")]
    FailsInEveryRun(String),
    /// A curve file is invalid.
    #[error("{}: {source}", path.display())]
    CurveFile {
        /// Path of the file.
        path: PathBuf,
        /// Cause of the error.
        source: CurveFileError,
    },
}

fn resumption(checkpoint: Option<&Path>) -> String {
    match checkpoint {
        Some(path) => format!("start the same run again to resume from {}", path.display()),
        None => "the run cannot resume because no state was saved".into(),
    }
}

impl FemError {
    pub(crate) fn parameter(
        entity: &str,
        field: &'static str,
        value: f64,
        requirement: &'static str,
    ) -> Self {
        FemError::OutOfRange { entity: entity.into(), field, value, requirement }
    }

    pub(crate) fn unsupported(entity: impl Into<String>, reason: Unsupported) -> Self {
        FemError::Unsupported { entity: entity.into(), reason }
    }

    pub(crate) fn factorisation(
        unknowns: usize,
        source: impl Into<Box<dyn Error + Send + Sync>>,
    ) -> Self {
        FemError::Factorisation { unknowns, source: Arc::from(source.into()) }
    }

    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        FemError::Io { action, path: path.into(), source: Arc::new(source) }
    }
}
