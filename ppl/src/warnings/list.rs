//! Warnings, and how they are put together.

use std::collections::BTreeMap;
use std::fmt;

use crate::posterior::SummaryRow;

/// The kind of a [`Warning`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WarningKind {
    /// A chain far below the others in log density, or one that hardly moved. What is found by
    /// comparing chains, or from all draws, is left out then.
    StuckChain,
    /// A chain ended early.
    Stopped,
    /// The chains were drawn from another density: other data, or another model.
    OtherDensity,
    /// A quantity is NaN or infinite at some draw.
    NotFinite,
    /// R̂ above 1.01.
    Disagreement,
    /// Separate modes between which the chains hardly change.
    Modes,
    /// Effective sample size below 100 per chain, or too few draws to tell.
    FewEffectiveDraws,
    /// E-BFMI below 0.3.
    Energy,
    /// Divergent transitions.
    Divergences,
    /// Trajectories cut at the largest tree depth.
    TreeDepth,
    /// Parameters about which the data said little.
    Uninformed,
    /// Parameters of which the data determine only a combination.
    Combination,
    /// Posterior mass piled up at a prior bound.
    Boundary,
    /// Prior and data pull in different directions; see [`PowerScaling`](crate::PowerScaling).
    PriorDataConflict,
    /// The prior decides more than the data; see [`PowerScaling`](crate::PowerScaling).
    StrongPrior,
    /// No statement about data ran, or one had none.
    NoData,
    /// Points that a statement rejected, after the warmup or often in it.
    Rejections,
    /// Draws of the prior that a statement rejected.
    PriorOutsideDomain,
    /// Draws at which predictions could not be computed.
    Unpredicted,
}

/// Something to know about a run before its numbers are used.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// What kind of thing.
    pub kind: WarningKind,
    /// What was found, with names and numbers.
    pub what: String,
    /// What to try.
    pub advice: &'static str,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}. {}", self.what, self.advice)
    }
}

/// The names of numbers as the table shows them, by those with indices.
pub(super) struct ShownNames<'r>(BTreeMap<&'r str, &'r str>);

impl<'r> ShownNames<'r> {
    pub(super) fn new(rows: &'r [SummaryRow]) -> Self {
        Self(rows.iter().map(|row| (row.place.as_str(), row.name.as_str())).collect())
    }

    pub(super) fn shown<'n>(&self, place: &'n str) -> &'n str
    where
        'r: 'n,
    {
        self.0.get(place).copied().unwrap_or(place)
    }
}

/// Warnings as they are made.
#[derive(Default)]
pub(super) struct Warnings(pub(super) Vec<Warning>);

impl Warnings {
    /// Adds one if there is anything to name: `items` are what a warning with these words is about.
    pub(super) fn add(
        &mut self,
        kind: WarningKind,
        words: &str,
        items: &str,
        advice: &'static str,
    ) {
        if !items.is_empty() {
            self.0.push(Warning { kind, what: format!("{words}{items}"), advice });
        }
    }
}
