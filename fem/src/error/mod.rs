//! What can be wrong with a problem, and what helps.

mod file;
mod step;

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use fem_mesh::MeshError;

pub use file::{CheckpointError, CurveFileError};
pub use step::StepFailure;

/// Why a problem cannot be set up, or stopped before its end.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FemError {
    /// The mesh is not sound.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The platens cannot be placed.
    #[error("{0}: check the surface names")]
    Platens(&'static str),
    /// A surface that a condition names is absent or empty.
    #[error(
        "the mesh has no triangles on surface '{name}', where {role}; it has {present}: name the surfaces when the mesh is made or read (a compression test needs 'bottom' and 'top')"
    )]
    MissingSurface {
        /// The surface that is needed.
        name: String,
        /// What it is needed for.
        role: &'static str,
        /// The surfaces that there are.
        present: String,
    },
    /// As many materials as regions are needed.
    #[error(
        "{materials} materials for {regions} regions ({names}): give one material to each region, in this order"
    )]
    MaterialCount {
        /// Materials given.
        materials: usize,
        /// Regions of the mesh.
        regions: usize,
        /// The names of the regions.
        names: String,
    },
    /// A parameter out of its range.
    #[error("{entity}: {field} = {value} must be {requirement}")]
    Parameter {
        /// What the parameter belongs to, as "material.matrix".
        entity: String,
        /// Its name.
        field: &'static str,
        /// The value given.
        value: f64,
        /// What is accepted.
        requirement: &'static str,
    },
    /// A combination that the equations do not offer.
    #[error("{entity}: {message}; {help}")]
    Unsupported {
        /// What it concerns.
        entity: String,
        /// What is not possible.
        message: String,
        /// What to do instead.
        help: String,
    },
    /// No equilibrium was found, although the load step was cut to its least size.
    #[error(
        "no equilibrium after {displacement_mm} mm ({time_s} s) with steps down to {step_s} s ({source}); {help}"
    )]
    NotConverged {
        /// The last displacement with equilibrium, mm.
        displacement_mm: f64,
        /// Its time, s.
        time_s: f64,
        /// The last increment tried, s.
        step_s: f64,
        /// Why the last try ended.
        source: StepFailure,
        /// What helps.
        help: String,
    },
    /// The matrix could not be factorised in its own memory.
    #[error(
        "the sparse factorisation of {unknowns} unknowns failed: {source}; use a coarser mesh or more memory"
    )]
    Factorisation {
        /// Number of equations.
        unknowns: usize,
        /// What the solver said.
        source: Arc<dyn Error + Send + Sync>,
    },
    /// A file that cannot be read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// `read` or `write`.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: Arc<io::Error>,
    },
    /// A file that is not the state of this run.
    #[error("{}: {source}", path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what helps.
        source: CheckpointError,
    },
    /// Another rank failed alone, as by a file that it could not write; it stopped all.
    #[error("rank {rank}: {message}")]
    Rank {
        /// Which.
        rank: usize,
        /// What it said.
        message: String,
    },
    /// Another rank is gone.
    #[error("rank {rank} is gone, and the run with it; {}", go_on(checkpoint.as_deref()))]
    RankLost {
        /// Which.
        rank: usize,
        /// Where the run goes on from, if its state was saved.
        checkpoint: Option<PathBuf>,
    },
    /// A file that is not a curve.
    #[error("{}: {source}", path.display())]
    CurveFile {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: CurveFileError,
    },
}

fn go_on(checkpoint: Option<&Path>) -> String {
    match checkpoint {
        Some(path) => format!("the same run goes on from {}", path.display()),
        None => "no state was saved from which it could go on".into(),
    }
}

impl FemError {
    pub(crate) fn parameter(
        entity: &str,
        field: &'static str,
        value: f64,
        requirement: &'static str,
    ) -> Self {
        FemError::Parameter { entity: entity.into(), field, value, requirement }
    }

    pub(crate) fn unsupported(
        entity: impl Into<String>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Self {
        FemError::Unsupported { entity: entity.into(), message: message.into(), help: help.into() }
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
