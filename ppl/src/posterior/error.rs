//! Why there is no posterior.

use crate::density::Rejection;
use crate::inspect::ModelError;
use crate::sampler::{RunError, StopReason};

/// A model that was not sampled.
#[derive(Debug, thiserror::Error)]
pub enum SampleError {
    /// The model cannot be evaluated at all.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The density that screens is not of the same unknowns as the one that decides.
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
    /// The draws make no posterior, as when an interrupt came before the first.
    #[error(transparent)]
    Posterior(#[from] PosteriorError),
}

/// Chains that do not make a posterior.
#[derive(Clone, Debug, thiserror::Error)]
pub enum PosteriorError {
    /// The model itself is at fault.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The chains are those of another density.
    #[error("the chains have {got} coordinates but the model has {expected}: they are not its own")]
    Dimension {
        /// Coordinates of the model.
        expected: usize,
        /// Coordinates of the chains.
        got: usize,
    },
    /// Lengths within the chains disagree.
    #[error("the chains do not fit together: {0}; give chains as a sampler returned them")]
    Damaged(String),
    /// At least one chain has no draw.
    #[error(
        "chain {chain} has no draw: {}. The sampler's `run` returns the chains as they are, for its \
         `resume`",
        .source.as_ref().map_or("none was asked for".to_owned(), StopReason::to_string)
    )]
    NoDraws {
        /// The empty chain.
        chain: usize,
        /// Why it stopped; `None` if no draw was asked for.
        source: Option<StopReason>,
    },
    /// Names or shapes depend on the values of unknowns.
    #[error(
        "`{name}` is not there with the same shape at every draw: record it outside `if` on unknowns"
    )]
    ChangingShape {
        /// The quantity.
        name: String,
    },
    /// The model stopped while its quantities were computed at a draw.
    #[error("the model stopped at a draw of chain {chain}: {source}")]
    Stopped {
        /// Chain of the draw.
        chain: usize,
        /// What it said.
        source: Rejection,
    },
}
