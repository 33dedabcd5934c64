//! Errors because of which no posterior can be computed.

use crate::density::Rejection;
use crate::model::inspect::ModelError;
use crate::sampler::{RunError, StopReason};

/// Error when a model is sampled.
#[derive(Debug, thiserror::Error)]
pub enum SampleError {
    /// The model cannot be evaluated.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The cheap model (screening) and the expensive model (deciding) have different unknowns.
    #[error(
        "the screening model has {screening}, the deciding one {deciding}: both need the same unknowns"
    )]
    Screening {
        /// Unknowns of the cheap model.
        screening: String,
        /// Unknowns of the expensive model.
        deciding: String,
    },
    /// The run could not start.
    #[error(transparent)]
    Run(#[from] RunError),
    /// No posterior can be computed from the chains, for example because the run was interrupted before the first
    /// draw.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
}

/// Error when a posterior is computed from chains.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PosteriorError {
    /// The model is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The chains come from a density with a different number of coordinates.
    #[error("the chains have {got} coordinates but the model has {expected}: they are not its own")]
    Dimension {
        /// Number of coordinates of the model.
        expected: usize,
        /// Number of coordinates of the chains.
        got: usize,
    },
    /// The lengths of the vectors in the chains are inconsistent.
    #[error("the chains do not fit together: {0}; give chains as a sampler returned them")]
    Damaged(String),
    /// Draws by name do not fit the model.
    #[error("the draws do not fit the model: {problem}")]
    Draws {
        /// Description of the problem, with the names of the model.
        problem: String,
    },
    /// At least one chain has no draw.
    #[error(
        "chain {chain} has no draw: {}. The sampler's `run` returns the chains as they are, for its \
         `resume`",
        .source.as_ref().map_or("none was asked for".to_owned(), StopReason::to_string)
    )]
    NoDraws {
        /// Index of the empty chain.
        chain: usize,
        /// Reason why the chain stopped; `None` if no draw was requested.
        source: Option<StopReason>,
    },
    /// Names or shapes of quantities depend on the values of unknowns.
    #[error(
        "`{name}` is not there with the same shape at every draw: record it outside `if` on unknowns"
    )]
    ChangingShape {
        /// Name of the quantity.
        name: String,
    },
    /// A fatal error occurred while the model's quantities were computed at a draw.
    #[error("the model stopped at a draw of chain {chain}: {source}")]
    Stopped {
        /// Index of the chain.
        chain: usize,
        /// The fatal error.
        source: Rejection,
    },
}
