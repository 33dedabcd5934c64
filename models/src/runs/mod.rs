//! The simulations of an ensemble.
//!
//! 1. `ensemble_runs`, `made_on`, `unusable_runs`: folders and records of runs, their specimens, runs without quantities
//! 2. `first_runs`: comparison of the first runs with the specimens
//! 3. `microstructures`, `run_source`, `run_sources`: packings or images of the runs, and where the runs come from
//! 4. `level_runs`, `fidelity`, `quadrature`: runs on several meshes, and what meshes and quadratures change
//! 5. `mesh_error`, `map_fields`: error of the mesh and fields at the posterior mode

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
