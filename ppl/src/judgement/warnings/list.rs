//! Types of warnings, and their construction.

use std::collections::BTreeMap;
use std::fmt;

use crate::posterior::SummaryRow;

/// Kind of a [`Warning`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum WarningKind {
    /// A chain has far lower log densities than the other chains, or hardly moved. In this case, warnings that
    /// compare chains or use all draws are omitted.
    StuckChain,
    /// A chain ended early.
    Stopped,
    /// The chains were drawn from another density, with other data or another model.
    OtherDensity,
    /// A quantity is NaN or infinite at some draw.
    NotFinite,
    /// The chains do not agree: R-hat is above 1.01.
    Disagreement,
    /// There are separate modes between which the chains hardly change.
    Modes,
    /// The effective sample size is below 100 per chain, or there are too few draws to estimate it.
    FewEffectiveDraws,
    /// The energy of the Hamiltonian changes too little from draw to draw: E-BFMI is below 0.3.
    Energy,
    /// Some transitions diverged.
    Divergences,
    /// Some trajectories reached the largest tree depth.
    TreeDepth,
    /// The data inform some parameters only weakly.
    Uninformed,
    /// The data determine only a combination of some parameters.
    Combination,
    /// Draws pile up at a prior bound.
    Boundary,
    /// Prior and data conflict; see [`PowerScaling`](crate::PowerScaling).
    PriorDataConflict,
    /// The prior dominates the data; see [`PowerScaling`](crate::PowerScaling).
    StrongPrior,
    /// No observation statement was executed, or an observation has no data.
    NoData,
    /// A statement rejected points, after the warmup or frequently during it.
    Rejections,
    /// A statement rejected draws from the prior.
    PriorOutsideDomain,
    /// Predictions could not be computed at some draws.
    Unpredicted,
}

/// A problem of a run that affects the use of its results.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Kind of the problem.
    pub kind: WarningKind,
    /// Description of the problem, with names and numbers.
    pub what: String,
    /// Advice for the user.
    pub advice: &'static str,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}. {}", self.what, self.advice)
    }
}

/// Map from element names with indices, such as `sd[0]`, to the names in the summary table, such as `sd[north]`.
pub(super) struct ShownNames<'r>(BTreeMap<&'r str, &'r str>);

impl<'r> ShownNames<'r> {
    pub(super) fn new(rows: &'r [SummaryRow]) -> Self {
        Self(rows.iter().map(|row| (row.place.as_str(), row.name.as_str())).collect())
    }

    pub(super) fn shown<'n>(&self, element: &'n str) -> &'n str
    where
        'r: 'n,
    {
        self.0.get(element).copied().unwrap_or(element)
    }
}

/// Collector of warnings.
#[derive(Default)]
pub(super) struct Warnings(pub(super) Vec<Warning>);

impl Warnings {
    /// Adds a warning if `items`, the list of the affected quantities or chains, is not empty.
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
