//! Why a run could not start.

use std::collections::BTreeMap;

use thiserror::Error;

use crate::{
    density::{FatalError, Location, Rejection},
    words::{further, points_tried},
};

/// A run that could not start. Trouble after the start ends a chain and keeps its draws, see
/// [`Chain::stopped`](super::Chain::stopped).
#[derive(Debug, Error)]
pub enum RunError {
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
    /// No starting point was accepted by the density.
    #[error(
        "chain {chain} cannot start: {} were rejected ({}); the last: {last}{}. Check the statement named \
         and its data, or give starting values by `init_value`",
        points_tried(*.tries, *.prior_draws), tally(.rejections), further(.detail)
    )]
    Initialisation {
        /// Number of the chain.
        chain: usize,
        /// Uniform or given points tried.
        tries: u32,
        /// Draws from the prior tried.
        prior_draws: u32,
        /// How often each location of the model rejected.
        rejections: BTreeMap<Location, u64>,
        /// The last rejection.
        #[source]
        last: Box<Rejection>,
        /// What else can be said about it, as the datum at fault.
        detail: Option<String>,
    },
    /// A starting value by name that does not fit the model.
    #[error("starting value of {0}")]
    Values(String),
    /// The model reported a fatal error before the first transition.
    #[error("chain {chain} cannot start: {}", .detail.clone().unwrap_or_else(|| .source.to_string()))]
    Fatal {
        /// Number of the chain.
        chain: usize,
        /// What it reported.
        source: Box<FatalError>,
        /// What the model itself says of it, where it cannot be evaluated at all.
        detail: Option<String>,
    },
    /// The density that screens is not one of the same unknowns as the one that decides.
    #[error(
        "the screening density has {screening}, the deciding one {deciding}: both need the same unknowns"
    )]
    Screening {
        /// Unknowns of the cheap density.
        screening: String,
        /// Unknowns of the expensive density.
        deciding: String,
    },
    /// The chains to go on with do not fit.
    #[error("cannot go on with earlier chains: {reason}; {help}")]
    Resume {
        /// What does not fit.
        reason: String,
        /// What to do.
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
