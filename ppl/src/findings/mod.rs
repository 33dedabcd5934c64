//! What is wrong with a run, in words, and what to try.

mod convergence;
mod hamiltonian;
mod information;
pub(crate) mod stuck;

use std::collections::BTreeMap;
use std::fmt;

use crate::diagnostics::Identifiability;
use crate::posterior::Posterior;
use crate::summary::SummaryRow;

/// The kind of a [`Finding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FindingKind {
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
    /// Points that a statement rejected.
    Rejections,
    /// Draws at which predictions could not be computed.
    Unpredicted,
}

/// Something to know about a run before its numbers are used.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What kind of thing.
    pub kind: FindingKind,
    /// What was found, with names and numbers.
    pub what: String,
    /// What to try.
    pub advice: &'static str,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}. {}", self.what, self.advice)
    }
}

/// At most four of the items, and how many were left out.
pub(crate) fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    let shown = items.iter().take(4).map(String::as_str).collect::<Vec<_>>().join(", ");
    match items.len() {
        0..=4 => shown,
        n => format!("{shown} and {} more", n - 4),
    }
}

/// The names of numbers as the table shows them, by those with indices.
struct Names<'r>(BTreeMap<&'r str, &'r str>);

impl<'r> Names<'r> {
    fn new(rows: &'r [SummaryRow]) -> Self {
        Self(rows.iter().map(|row| (row.place.as_str(), row.name.as_str())).collect())
    }

    fn shown<'n>(&self, place: &'n str) -> &'n str
    where
        'r: 'n,
    {
        self.0.get(place).copied().unwrap_or(place)
    }
}

/// Findings as they are made.
#[derive(Default)]
struct Found(Vec<Finding>);

impl Found {
    /// Says it if there is anything to name: `items` are what a finding with these words is about.
    fn say(&mut self, kind: FindingKind, words: &str, items: &str, advice: &'static str) {
        if !items.is_empty() {
            self.0.push(Finding { kind, what: format!("{words}{items}"), advice });
        }
    }
}

pub(crate) fn find(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
) -> Vec<Finding> {
    let mut found = Found::default();
    let names = Names::new(rows);
    stuck::find(&posterior.chains, &mut found);
    let are_together = found.0.is_empty();
    convergence::find(posterior, rows, &mut found);
    let modes = if are_together { convergence::separate_modes(posterior) } else { Vec::new() };
    if are_together {
        convergence::compare(posterior, rows, &modes, &names, &mut found);
    }
    if posterior.chains.max_depth.is_some() {
        hamiltonian::find(posterior, &names, &mut found);
    }
    // without data there is nothing that a posterior could have learned
    if are_together && posterior.has_likelihood() {
        information::find(posterior, rows, identifiability, &modes, &names, &mut found);
    }
    model(posterior, &mut found);
    found.0
}

/// What the model's statements refused.
fn model(posterior: &Posterior, found: &mut Found) {
    let rejections = posterior.rejections();
    let after =
        rejections.iter().filter(|(_, counts)| counts.1 > 0).map(|(place, (warmup, sampling))| {
            format!("{sampling} at {place} (and {warmup} in the warmup)")
        });
    found.say(
        FindingKind::Rejections,
        "Points were rejected because a statement has no density there: ",
        &list(after),
        "Harmless if rare and at the edge of the support; otherwise the statement's support does \
         not fit the unknowns' priors",
    );
    let places = posterior.unpredicted.iter().map(|(place, count)| format!("{count} at {place}"));
    found.say(
        FindingKind::Unpredicted,
        "Draws without prediction (their values are NaN): ",
        &list(places),
        "A prediction's parameters left their domain; check the statement",
    );
}
