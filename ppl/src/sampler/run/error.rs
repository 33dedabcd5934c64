//! Errors that prevent a run from starting.

use std::collections::BTreeMap;

use thiserror::Error;

use crate::density::{FatalError, Location, Rejection};
use crate::quantity::format::{further, points_tried};

/// Error of a run that could not start. An error after the start ends one chain and keeps its draws, see
/// [`Chain::stopped`](crate::Chain::stopped).
#[derive(Debug, Error)]
pub enum RunError {
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
    /// The density rejected every starting point.
    #[error(
        "chain {chain} cannot start: {} were rejected ({}); the last rejection: {last}{}. Check the named \
         statement and its data, or set starting values with `init_value`",
        points_tried(*.tries, *.prior_draws), tally(.rejections), further(.detail)
    )]
    Initialisation {
        /// Index of the chain.
        chain: usize,
        /// Number of starting points tried that were uniform or given by the user.
        tries: u32,
        /// Number of starting points tried that were draws from the prior.
        prior_draws: u32,
        /// Number of rejections per location in the model.
        rejections: BTreeMap<Location, u64>,
        /// The last rejection.
        #[source]
        last: Box<Rejection>,
        /// Additional description of the last rejection, such as the datum with zero density.
        detail: Option<String>,
    },
    /// A starting value given by name does not fit the model.
    #[error("starting value of {0}")]
    Values(String),
    /// The model reported a fatal error before the first transition.
    #[error("chain {chain} cannot start: {}", .detail.clone().unwrap_or_else(|| .source.to_string()))]
    Fatal {
        /// Index of the chain.
        chain: usize,
        /// The fatal error.
        source: Box<FatalError>,
        /// Description of the error by the model, if the model cannot be evaluated at any point.
        detail: Option<String>,
    },
    /// The screening density and the deciding density have different unknowns.
    #[error(
        "the screening density has {screening} and the deciding density has {deciding}: both must have the same \
         unknowns"
    )]
    Screening {
        /// Number of coordinates of the cheap density, in words.
        screening: String,
        /// Number of coordinates of the expensive density, in words.
        deciding: String,
    },
    /// The chains to resume do not fit this run.
    #[error("cannot resume the earlier chains: {reason}; {help}")]
    Resume {
        /// Property of the chains that does not fit the sampler or the density.
        reason: String,
        /// Suggested fix.
        help: &'static str,
    },
    /// The threads could not be started.
    #[error("cannot start the sampling threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

fn tally(rejections: &BTreeMap<Location, u64>) -> String {
    let counts: Vec<String> =
        rejections.iter().map(|(location, n)| format!("{n} × {location}")).collect();
    counts.join(", ")
}
