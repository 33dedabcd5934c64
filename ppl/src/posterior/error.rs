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
        "the screening model has {screening} and the deciding model has {deciding}: both must have the same \
         unknowns"
    )]
    Screening {
        /// Unknowns of the cheap model with their shapes, as a text such as `mu, sd[3]`.
        screening: String,
        /// Unknowns of the expensive model with their shapes, as a text such as `mu, sd[3]`.
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
    #[error(
        "the chains have {got} coordinates but the model has {expected}: the chains come from another model"
    )]
    Dimension {
        /// Number of coordinates of the model.
        expected: usize,
        /// Number of coordinates of the chains.
        got: usize,
    },
    /// The lengths of the vectors in the chains are inconsistent.
    #[error("the chains are inconsistent: {0}; use chains as returned by a sampler")]
    Damaged(String),
    /// Draws by name do not fit the model.
    #[error("the draws do not fit the model: {problem}")]
    Draws {
        /// Description of the problem, with the names of the model.
        problem: String,
    },
    /// There is no chain.
    #[error("there are no chains: a posterior needs the draws of at least one chain")]
    NoChains,
    /// At least one chain has no draw.
    #[error(
        "chain {chain} has no draw: {}. Call `run` of the sampler instead: it returns the incomplete \
         chains, which `resume` can continue",
        .source.as_ref().map_or("no draw was requested".to_owned(), StopReason::to_string)
    )]
    NoDraws {
        /// Index of the empty chain.
        chain: usize,
        /// Reason why the chain stopped; `None` if no draw was requested.
        source: Option<StopReason>,
    },
    /// Names or shapes of quantities depend on the values of unknowns.
    #[error(
        "`{name}` is missing or has another shape at some draws: record it outside of `if` on unknowns"
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
