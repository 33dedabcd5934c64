//! What can be wrong with a test, and how to mend it.

use crate::mesh::MeshError;

/// Why a compression test cannot be set up, or stopped before its end.
#[derive(Clone, Debug, thiserror::Error)]
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
    #[error("{entity}: {message}; {mend}")]
    Unsupported {
        /// What it concerns.
        entity: String,
        /// What is not possible.
        message: String,
        /// What to do instead.
        mend: String,
    },
    /// No equilibrium was found, although the load step was cut to its least size.
    #[error(
        "no equilibrium after {displacement_mm} mm ({time_s} s) with steps down to {step_s} s ({reason}); refine the mesh, raise the viscosity, or allow smaller steps"
    )]
    NotConverged {
        /// The last displacement with equilibrium, mm.
        displacement_mm: f64,
        /// Its time, s.
        time_s: f64,
        /// The last increment tried, s.
        step_s: f64,
        /// Why the last try ended.
        reason: String,
    },
    /// The matrix could not be factorised in its own memory.
    #[error(
        "the sparse factorisation of {unknowns} unknowns failed: {reason}; use a coarser mesh or more memory"
    )]
    Factorisation {
        /// Number of equations.
        unknowns: usize,
        /// What the solver said.
        reason: String,
    },
    /// The state of a run cannot be saved, or read to go on from.
    #[error("{path}: {message}")]
    Checkpoint {
        /// The file.
        path: String,
        /// What is wrong, and how to mend it.
        message: String,
    },
    /// A curve file cannot be written or read.
    #[error("{path}: {message}")]
    CurveFile {
        /// The file.
        path: String,
        /// What is wrong, and how to mend it.
        message: String,
    },
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
}
