//! Why a calibration cannot be made.

use ppl::{OptimizeError, PosteriorError, Rejection, SampleError};
use surrogate::SurrogateError;

/// A calibration that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// Covariances need at least two specimens.
    #[error("{0} specimen: a calibration with scatter between specimens needs at least two")]
    TooFew(usize),
    /// Something is known of other specimens than there are, or not the same of each.
    #[error(
        "known inputs of the forward model are given for {found} specimens, of {expected}, or not as many of each"
    )]
    Known {
        /// Number of specimens.
        expected: usize,
        /// Number of rows.
        found: usize,
    },
    /// Too little is known of what inputs may be that are not known of a specimen.
    #[error(
        "some specimens' inputs of the forward model are not known, and {found} others are too few to say what \
         they may be: it takes four"
    )]
    Population {
        /// Others whose inputs are known.
        found: usize,
    },
    /// Specimens with other quantities than the surrogate gives.
    #[error("a specimen has {found} quantities of interest, the surrogate has {expected}")]
    Quantities {
        /// Outputs of the surrogate.
        expected: usize,
        /// Values of the specimen.
        found: usize,
    },
    /// Groups of specimens that do not belong together.
    #[error("{group} {problem}")]
    Group {
        /// The group, or the parameter.
        group: String,
        /// What is wrong with it.
        problem: String,
    },
    /// The surrogate is not one of the quantities of interest.
    #[error(transparent)]
    Surrogate(#[from] SurrogateError),
    /// The sampler could not start.
    #[error(transparent)]
    Sample(#[from] SampleError),
    /// The draws do not make a posterior.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
    /// The mode could not be found.
    #[error(transparent)]
    Mode(#[from] OptimizeError),
    /// Labels that are not those of the quantities of interest.
    #[error(transparent)]
    Label(#[from] ppl::LabelError),
    /// Specimens cannot be left out: too few draws, or a specimen without a density.
    #[error("leaving out a specimen: {0}")]
    LeaveOut(#[from] ppl::diagnostics::LooError),
    /// The model rejects its own mode.
    #[error("at the mode: {0}")]
    Rejection(#[from] Rejection),
}
