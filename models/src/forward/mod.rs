//! The forward model of a calibration: fitted surrogate, its errors, and what follows from the posterior: predicted
//! curves, shares of the uncertainty, influence of specimens, simulated laboratories.

pub(crate) mod extension;
pub(crate) mod fit;
pub(crate) mod fitted;
pub(crate) mod influence;
pub(crate) mod laboratories;
pub(crate) mod posterior_draws;
pub(crate) mod predicted_curves;
pub(crate) mod prior_sensitivity;
pub(crate) mod specimen_stiffness;
pub(crate) mod uncertainty;
