//! The simulations of an ensemble: where the runs come from, on which meshes and microstructures they are made, and what
//! meshes and quadratures change.

pub(crate) mod ensemble_runs;
pub(crate) mod fidelity;
pub(crate) mod first_runs;
pub(crate) mod level_runs;
pub(crate) mod made_on;
pub(crate) mod map_fields;
pub(crate) mod mesh_error;
pub(crate) mod microstructures;
pub(crate) mod quadrature;
pub(crate) mod run_source;
pub(crate) mod run_sources;
pub(crate) mod unusable_runs;
