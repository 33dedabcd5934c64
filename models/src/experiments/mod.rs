//! Measured and virtual specimens: their curves, quantities of interest and checks, and the displacements and mesh sizes
//! of simulations that are compared with them.
//!
//! 1. `experiment_inputs`, `virtual_inputs`, `mesh_scale`: specimens of a case, and their size relative to the mesh
//! 2. `data_range`, `few_specimens`: measured means against the range of the simulations, scatter of a few specimens
//! 3. `preparation`, `specimen_notes`, `specimen_quantities`: prepared curves, notes, quantities of interest
//! 4. `closed_form`, `unit_slip`, `followed_program`, `measured_values`, `simulated_displacement`: comparisons with what is
//!    expected
//! 5. `common_specimens`, `specimen_checks`, `validation_folders`: specimens of several tests, checks of a table, validations

pub(crate) mod closed_form;
pub(crate) mod common_specimens;
pub(crate) mod data_range;
pub(crate) mod experiment_inputs;
pub(crate) mod few_specimens;
pub(crate) mod followed_program;
pub(crate) mod measured_values;
pub(crate) mod mesh_scale;
pub(crate) mod preparation;
pub(crate) mod simulated_displacement;
pub(crate) mod specimen_checks;
pub(crate) mod specimen_notes;
pub(crate) mod specimen_quantities;
pub(crate) mod unit_slip;
pub(crate) mod validation_folders;
pub(crate) mod virtual_inputs;
