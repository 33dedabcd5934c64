//! Measured and virtual specimens: their curves, quantities of interest and checks, and the displacements and mesh sizes
//! of simulations that are compared with them.

pub(crate) mod closed_form;
pub(crate) mod common_specimens;
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
pub(crate) mod validation_folders;
pub(crate) mod virtual_inputs;
