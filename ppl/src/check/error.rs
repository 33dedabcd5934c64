//! Why a check could not be carried out.

use crate::density::Rejection;
use crate::inspect::ModelError;
use crate::sampler::{RunError, StopReason};

/// A trial that could not be carried out.
#[derive(Debug, thiserror::Error)]
pub enum CheckError {
    /// The model is at fault.
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
    /// A setting makes no sense.
    #[error("{setting} = {value}: give at least {least}")]
    Setting {
        /// The setting.
        setting: &'static str,
        /// Its value.
        value: usize,
        /// The least that is accepted.
        least: usize,
    },
}
