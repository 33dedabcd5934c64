//! Errors of mode searches.

use thiserror::Error;

use crate::density::Rejection;
use crate::model::inspect::ModelError;
use crate::quantity::format::{further, points_tried};

/// Error of a mode search.
#[derive(Debug, Error)]
pub enum OptimizeError {
    /// A setting is outside its accepted range.
    #[error("setting `{setting}` = {value}: {help}")]
    Setting {
        /// Name of the builder method.
        setting: &'static str,
        /// Value given by the user.
        value: String,
        /// Values that the setting accepts.
        help: &'static str,
    },
    /// The model cannot be evaluated.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The density rejected every starting point.
    #[error(
        "no starting point: {} were rejected; the last rejection: {last}{}. Check the named statement and \
         its data, or set starting values with `init_value`",
        points_tried(*.tries, *.prior_draws), further(.detail)
    )]
    Start {
        /// Number of uniform starting points tried.
        tries: u32,
        /// Number of draws from the prior tried.
        prior_draws: u32,
        /// The last rejection.
        #[source]
        last: Box<Rejection>,
        /// Additional description of the last rejection, such as the datum with zero density.
        detail: Option<String>,
    },
    /// A starting value given by name does not fit the model.
    #[error("starting value of {0}")]
    Values(String),
    /// The density rejects points near the mode, or reports a fatal error.
    #[error("the search failed: {0}")]
    Density(#[from] Box<Rejection>),
    /// The optimiser failed.
    #[error("the search failed: {0}")]
    Optimiser(String),
    /// The density has no unknowns.
    #[error("the density has no unknowns, so that there is no mode to find")]
    NoUnknowns,
    /// The log density is not concave at the mode, so that there is no normal approximation.
    #[error(
        "no normal approximation: the log density is flat at the mode or increases away from it (coordinates at a \
         bound: {at_bound:?}); sample the posterior instead"
    )]
    NotConcave {
        /// Coordinates at a bound, see [`Mode::at_bound`](crate::Mode::at_bound).
        at_bound: Vec<usize>,
    },
}
