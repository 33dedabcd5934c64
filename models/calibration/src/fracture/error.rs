//! Errors of a calibration.

use ppl::{OptimizeError, PosteriorError, Rejection, SampleError};
use surrogate::SurrogateError;

/// Error of a calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// Covariances need at least two specimens.
    #[error("{0} specimen: a calibration with scatter between specimens needs at least two")]
    TooFew(usize),
    /// The number of rows with known inputs differs from the number of specimens, or the rows have different lengths.
    #[error(
        "known inputs of the forward model: {found} rows for {expected} specimens, or rows of different lengths"
    )]
    Known {
        /// Number of specimens.
        expected: usize,
        /// Number of rows.
        found: usize,
    },
    /// Fewer than four specimens have known inputs, so that the distribution of the unknown inputs of the other
    /// specimens cannot be estimated.
    #[error(
        "the inputs of some specimens are unknown, and only {found} specimens have known inputs: at least four are \
         needed to estimate the distribution of the unknown inputs"
    )]
    Population {
        /// Number of specimens with known inputs.
        found: usize,
    },
    /// A specimen and the surrogate have different numbers of quantities.
    #[error("a specimen has {found} quantities of interest, the surrogate has {expected}")]
    Quantities {
        /// Number of outputs of the surrogate.
        expected: usize,
        /// Number of values of the specimen.
        found: usize,
    },
    /// No quantity of a specimen was recorded.
    #[error("specimen {} of the calibration has no quantity of interest", specimen + 1)]
    NothingRecorded {
        /// Index of the specimen.
        specimen: usize,
    },
    /// A quantity was recorded for no specimen.
    #[error("no specimen has the quantity of interest {quantity}")]
    NotRecorded {
        /// Name of the quantity's column.
        quantity: String,
    },
    /// The ranges of the priors are not the box of the surrogate.
    #[error(
        "the ranges of the priors are not the box of the surrogate's inputs: fit the surrogate on these ranges"
    )]
    Priors,
    /// The groups of specimens are inconsistent.
    #[error("{group} {problem}")]
    Group {
        /// Name of the group or of the parameter.
        group: String,
        /// Description of the problem.
        problem: String,
    },
    /// The surrogate cannot be used for the quantities of interest.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The sampler could not start.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The posterior cannot be computed from the draws.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
    /// The mode could not be found.
    #[error(transparent)]
    Mode(#[from] OptimizeError),
    /// Labels do not match the quantities of interest.
    #[error(transparent)]
    Label(#[from] ppl::LabelError),
    /// The cross-validation failed: there are too few draws, or the density of a specimen cannot be computed.
    #[error("leaving out a specimen: {0}")]
    LeaveOut(#[from] ppl::diagnostics::LooError),
    /// The density of the model is zero at the mode.
    #[error("at the mode: {0}")]
    Rejection(#[from] Rejection),
}
