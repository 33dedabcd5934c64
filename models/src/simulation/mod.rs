//! One simulation of the test of a case: setup, parameters, recorded curve and its quantities of interest.

pub(crate) mod recorded;
pub(crate) mod resolution;
pub(crate) mod run_values;
pub(crate) mod setup;
pub(crate) mod simulator;
pub(crate) mod stiffness;
pub(crate) mod without_viscosity;
