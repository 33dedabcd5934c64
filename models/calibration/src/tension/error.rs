//! Why a law cannot be calibrated or compared.

use ppl::diagnostics::LooError;
use ppl::{DomainError, LabelError, SampleError};

/// A calibration or a cross-validation that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TensionError {
    /// The sampler could not start.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// Labels that do not fit.
    #[error(transparent)]
    Label(#[from] LabelError),
    /// Too few draws, or a specimen without density.
    #[error(transparent)]
    Loo(#[from] LooError),
    /// Draws that make no covariance.
    #[error(transparent)]
    Domain(#[from] DomainError),
}
