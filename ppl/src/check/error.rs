//! Errors that prevent a check.

use crate::density::Rejection;
use crate::model::inspect::ModelError;
use crate::sampler::{RunError, StopReason};

/// Error that ended a trial of a check.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The model is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The sampler could not start.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A posterior draw was rejected by the model.
    #[error(transparent)]
    Rejected(#[from] Rejection),
    /// The sampler stopped early.
    #[error("a chain ended early: {0}")]
    Stopped(#[source] StopReason),
    /// A setting is below its smallest accepted value.
    #[error("{setting} = {value}: give at least {least}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// Value given by the user.
        value: usize,
        /// Smallest accepted value.
        least: usize,
    },
}
