//! What is wrong with a run, in words, and what to try.

use std::fmt;

use rayon::prelude::*;

use crate::Role;
use crate::diagnostics::{Identifiability, Identification, Modes, e_bfmi, mean_and_variance};
use crate::posterior::Posterior;
use crate::sampler::Chain;
use crate::summary::{SummaryRow, cell};

/// The kind of a [`Finding`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FindingKind {
    /// A chain ended early.
    Stopped,
    /// A quantity is NaN or infinite at some draw.
    NotFinite,
    /// R̂ above 1.01.
    Disagreement,
    /// Separate modes between which the chains hardly change.
    Modes,
    /// Effective sample size below 100 per chain.
    FewEffectiveDraws,
    /// E-BFMI below 0.3.
    Energy,
    /// Divergent transitions.
    Divergences,
    /// Trajectories cut at the largest tree depth.
    TreeDepth,
    /// Parameters about which the data said little.
    Uninformed,
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

/// The contraction below which the posterior is wider than the prior, whatever the draws.
const WIDENED: f64 = -0.5;

/// At most four of the items, and how many were left out.
pub(crate) fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    let shown = items.iter().take(4).map(String::as_str).collect::<Vec<_>>().join(", ");
    match items.len() {
        0..=4 => shown,
        n => format!("{shown} and {} more", n - 4),
    }
}

pub(crate) fn find(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
) -> Vec<Finding> {
    let mut found = Vec::new();
    let mut say = |kind, what, advice| found.push(Finding { kind, what, advice });
    let runs = &posterior.chains.chains;
    let draws = posterior.chains.len();
    let total = draws * runs.len();

    for (chain, run) in runs.iter().enumerate() {
        if let Some(reason) = &run.stopped {
            say(
                FindingKind::Stopped,
                format!("Chain {chain} ended after {} draws: {reason}", run.len()),
                "All chains were cut to the shortest; mend the cause and run again before \
                 trusting the result",
            );
        }
    }

    let not_finite = rows.iter().filter(|r| !r.mean.is_finite()).map(|r| r.name.clone());
    let not_finite = list(not_finite);
    if !not_finite.is_empty() {
        say(
            FindingKind::NotFinite,
            format!("Some draws are NaN or infinite: {not_finite}"),
            "Look for a logarithm, root or division at the edge of its domain",
        );
    }

    let mut split: Vec<&SummaryRow> = rows.iter().filter(|r| r.rhat > 1.01).collect();
    if !split.is_empty() {
        split.sort_by(|a, b| b.rhat.total_cmp(&a.rhat));
        let worst = list(split.iter().map(|r| format!("{} ({:.3})", r.name, r.rhat)));
        say(
            FindingKind::Disagreement,
            format!("The chains do not agree yet (R-hat above 1.01): {worst}"),
            "Run longer; if that does not help, look for several modes or parameters that only \
             act together, and reparametrise or give stronger priors",
        );
    }

    let apart = list(separate_modes(posterior));
    if !apart.is_empty() {
        say(
            FindingKind::Modes,
            format!("The posterior seems to have several modes: {apart}"),
            "The share of draws in a mode is where the chains began, not its probability: use Smc, \
             which weighs modes; or start from Pathfinder (`init_pathfinder`), which passes over \
             modes of no weight; or take the modes apart by a stronger prior, or by an order if \
             they only exchange labels",
        );
    }

    let enough = 100.0 * runs.len() as f64;
    let mut few: Vec<&SummaryRow> =
        rows.iter().filter(|r| r.ess_bulk.min(r.ess_tail) < enough).collect();
    if !few.is_empty() {
        let ess = |r: &SummaryRow| r.ess_bulk.min(r.ess_tail);
        few.sort_by(|a, b| ess(a).total_cmp(&ess(b)));
        let worst = list(few.iter().map(|r| format!("{} ({:.0})", r.name, ess(r))));
        say(
            FindingKind::FewEffectiveDraws,
            format!("Effective sample size below {enough:.0} (100 per chain): {worst}"),
            "Draw more; means, intervals and R-hat of these are not reliable",
        );
    }

    if posterior.chains.max_depth.is_some() {
        hamiltonian(posterior, total, &mut say);
    }

    for (label, words) in [
        (Identification::Not, "The data did not inform (contraction below 0.1)"),
        (Identification::Weakly, "The data informed only weakly (contraction below 0.5)"),
    ] {
        // entries of a matrix, as a Cholesky factor, say little one by one
        let rows = identifiability
            .iter()
            .filter(|r| r.label() == label && r.contraction() >= WIDENED && !r.name.contains(','));
        let names = list(rows.map(|row| format!("{} ({:.2})", row.name, row.contraction())));
        if !names.is_empty() {
            say(
                FindingKind::Uninformed,
                format!("{words}: {names}"),
                "What is reported for these is mostly the prior; measure something that depends \
                 on them, or state them as assumed",
            );
        }
    }
    let widened = identifiability.iter().filter(|row| row.contraction() < WIDENED);
    let widened = list(widened.map(|row| {
        let [before, after] = [row.prior.sd, row.posterior.sd].map(cell);
        format!("{} (sd {after} after {before})", row.name)
    }));
    if !widened.is_empty() {
        say(
            FindingKind::PriorDataConflict,
            format!("The posterior is wider than the prior: {widened}"),
            "The data ask for values that the prior holds to be rare: see whether it means to",
        );
    }
    let truncated = identifiability.iter().filter(|row| row.truncated());
    let truncated = list(truncated.map(|row| {
        format!("{} ({:.0} %)", row.name, 100.0 * row.boundary_mass.unwrap_or_default())
    }));
    if !truncated.is_empty() {
        say(
            FindingKind::Boundary,
            format!("Draws pile up at a prior bound: {truncated}"),
            "The prior cuts the posterior off: widen it if the bound is not physical",
        );
    }

    let rejections = posterior.rejections();
    let after: Vec<String> = rejections
        .iter()
        .filter(|(_, counts)| counts.1 > 0)
        .map(|(place, (warmup, sampling))| {
            format!("{sampling} at {place} (and {warmup} in the warmup)")
        })
        .collect();
    if !after.is_empty() {
        say(
            FindingKind::Rejections,
            format!(
                "Points were rejected because a statement has no density there: {}",
                list(after)
            ),
            "Harmless if rare and at the edge of the support; otherwise the statement's support \
             does not fit the unknowns' priors",
        );
    }
    if !posterior.unpredicted.is_empty() {
        let places =
            posterior.unpredicted.iter().map(|(place, count)| format!("{count} at {place}"));
        say(
            FindingKind::Unpredicted,
            format!("Draws without prediction (their values are NaN): {}", list(places)),
            "A prediction's parameters left their domain; check the statement",
        );
    }
    found
}

/// The parameters with separate modes that are not mixed, with the chains in each.
fn separate_modes(posterior: &Posterior) -> Vec<String> {
    let parameters: Vec<_> = posterior
        .layout
        .with_role(Role::Parameter)
        .filter_map(|variable| posterior.posterior.get(&variable.name))
        .flat_map(|values| posterior.posterior.traces_in(values))
        .collect();
    let words = |(name, trace): &(String, Vec<Vec<f64>>)| {
        let chains: Vec<&[f64]> = trace.iter().map(Vec::as_slice).collect();
        let modes = Modes::find(&chains).filter(|modes| !modes.mixed())?;
        let places = modes.centres.iter().enumerate().map(|(mode, centre)| {
            let sitting = modes.sitting_in(mode);
            let centre = cell(*centre);
            match sitting.as_slice() {
                [] => format!("{centre} (no chain stays)"),
                [one] => format!("{centre} (chain {one})"),
                all => {
                    let all: Vec<String> = all.iter().map(usize::to_string).collect();
                    format!("{centre} (chains {})", all.join(", "))
                }
            }
        });
        let places = places.collect::<Vec<_>>().join(" and ");
        let changes: usize = modes.changes.iter().sum();
        let count = modes.centres.len();
        Some(format!("{name} has {count}, near {places}, with {changes} changes between them"))
    };
    parameters.par_iter().filter_map(words).collect()
}

/// What only a run of Hamiltonian Monte Carlo can show.
fn hamiltonian(
    posterior: &Posterior,
    total: usize,
    say: &mut impl FnMut(FindingKind, String, &'static str),
) {
    let runs = &posterior.chains.chains;
    let low = runs.iter().enumerate().filter_map(|(chain, run)| {
        let energy: Vec<f64> = run.stats.iter().map(|s| s.energy).collect();
        let fraction = e_bfmi(&energy);
        (fraction < 0.3).then(|| format!("chain {chain} ({fraction:.2})"))
    });
    let low = list(low);
    if !low.is_empty() {
        say(
            FindingKind::Energy,
            format!("Energy changes too little from draw to draw (E-BFMI below 0.3): {low}"),
            "Heavy tails or a funnel: reparametrise (non-centred) or give stronger priors to \
             scales",
        );
    }

    let divergences = posterior.chains.divergences();
    if divergences > 0 {
        let place = where_divergences_are(posterior);
        say(
            FindingKind::Divergences,
            format!("{divergences} of {total} trajectories diverged{place}"),
            "The posterior is too curved there for the step size, and draws are missing: raise \
             the target acceptance (to 0.95, then 0.99), or reparametrise",
        );
    }

    let limit = posterior.chains.max_depth;
    let cut = runs.iter().flat_map(|run| &run.stats).filter(|s| Some(s.depth) == limit).count();
    if cut * 100 > total {
        say(
            FindingKind::TreeDepth,
            format!(
                "{cut} of {total} trajectories were cut at the largest tree depth (mass matrix: {})",
                maps(runs)
            ),
            "Sampling is slow but not wrong: a longer warmup or a reparametrisation shortens the \
             trajectories",
        );
    }
}

/// The kinds of mass matrix of the chains, each once.
fn maps(runs: &[Chain]) -> String {
    let mut kinds: Vec<String> = Vec::new();
    for run in runs {
        let kind = run.warmup.switches.last().map_or("untuned".into(), |last| last.map.to_string());
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
    }
    kinds.join(" or ")
}

/// The parameters whose divergences lie farthest from the centre of the posterior, in units of its
/// standard deviation.
fn where_divergences_are(posterior: &Posterior) -> String {
    let points: Vec<_> = posterior.divergences.iter().filter(|p| !p.values.is_empty()).collect();
    let Some(first) = points.first() else {
        return String::new();
    };
    let mut shifts: Vec<(f64, String)> = (0..first.values.len())
        .into_par_iter()
        .filter_map(|k| {
            let name = &first.values[k].0;
            let draws = posterior.posterior.trace(name)?.concat();
            let (centre, variance) = mean_and_variance(draws.iter().copied());
            let there = points.iter().map(|p| p.values[k].1).sum::<f64>() / points.len() as f64;
            let shift = (there - centre).abs() / variance.sqrt();
            let sd = variance.sqrt();
            shift
                .is_finite()
                .then(|| (shift, format!("{name} ≈ {there:.4} (posterior {centre:.4} ± {sd:.4})")))
        })
        .collect();
    shifts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let places: Vec<String> = shifts.into_iter().take(2).map(|(_, words)| words).collect();
    if places.is_empty() {
        String::new()
    } else {
        format!(", on average at {}", places.join(" and "))
    }
}
