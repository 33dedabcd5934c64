//! Errors of the calibration and the cross-validation of a law.

use ppl::diagnostics::LooError;
use ppl::{DomainError, LabelError, SampleError};

/// Error of a calibration or a cross-validation.
#[derive(Debug, thiserror::Error)]
pub enum TensionError {
    /// The sampler could not start.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// Labels do not fit the posterior.
    #[error(transparent)]
    Label(#[from] LabelError),
    /// There are too few draws, or a specimen has no density.
    #[error(transparent)]
    Loo(#[from] LooError),
    /// A covariance is not positive definite.
    #[error(transparent)]
    Domain(#[from] DomainError),
}
