//! Judgements of a posterior: summary, warnings, predictive checks, prior sensitivity.

pub(crate) mod power_scaling;
pub(crate) mod predictive;
pub(crate) mod summary;
pub(crate) mod warnings;
