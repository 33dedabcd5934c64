//! Measured and virtual specimens: their curves, quantities of interest and checks, and the displacements and mesh sizes
//! of simulations that are compared with them.
//!
//! 1. `mesh_scale`, `experiment_inputs`, `virtual_inputs`, `few_specimens`: sizes and keys of the specimens
//! 2. `specimen_quantities`, `specimen_notes`, `preparation`, `measured_values`: quantities and notes of one specimen
//! 3. `closed_form`, `unit_slip`, `followed_program`, `simulated_displacement`: comparisons with the test of the case
//! 4. `specimen_checks`, `common_specimens`, `validation_folders`: checks of all specimens

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
