//! Why a search was not made, or failed.

use thiserror::Error;

use crate::{
    density::Rejection,
    inspect::ModelError,
    words::{further, points_tried},
};

/// A search that could not be made.
#[derive(Debug, Error)]
pub enum OptimizeError {
    /// A setting out of its range.
    #[error("setting `{setting}` = {value}: {help}")]
    Setting {
        /// Name of the builder method.
        setting: &'static str,
        /// The value given.
        value: String,
        /// What is accepted.
        help: &'static str,
    },
    /// The model cannot be evaluated at all.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No starting point was accepted by the density.
    #[error(
        "no start: {} were rejected, the last: {last}{}; check that statement and its data, or give \
         starting values by `init_value`",
        points_tried(*.tries, *.prior_draws), further(.detail)
    )]
    Start {
        /// Uniform points tried.
        tries: u32,
        /// Draws from the prior tried.
        prior_draws: u32,
        /// The last rejection.
        #[source]
        last: Box<Rejection>,
        /// What else can be said about it, as the datum at fault.
        detail: Option<String>,
    },
    /// A starting value by name that does not fit the model.
    #[error("starting value of {0}")]
    Values(String),
    /// The density rejects points next to the mode, or reports a fatal error.
    #[error("the search failed: {0}")]
    Density(#[from] Box<Rejection>),
    /// The optimiser failed.
    #[error("the search failed: {0}")]
    Optimiser(String),
    /// There is nothing to find.
    #[error("the density has no unknowns, so that there is nothing to find")]
    NoUnknowns,
    /// The log density is not concave at the mode, so that no normal distribution fits there.
    #[error(
        "no normal approximation: the log density is flat or rises from the mode (coordinates at a \
         bound: {at_bound:?}); sample the posterior instead"
    )]
    NotConcave {
        /// See [`Mode::at_bound`](crate::Mode::at_bound).
        at_bound: Vec<usize>,
    },
}
