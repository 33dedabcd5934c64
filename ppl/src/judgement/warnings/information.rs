//! Warnings about the information in prior and data.

use std::collections::BTreeSet;

use rayon::prelude::*;

use crate::diagnostics::{
    BeforeAndAfter, Combination, Identifiability, Identification, MOST_COMBINED, Modes,
    combinations,
};
use crate::judgement::warnings::convergence::Separate;
use crate::judgement::warnings::list::{ShownNames, WarningKind, Warnings};
use crate::posterior::Posterior;
use crate::posterior::SummaryRow;
use crate::quantity::draws::Values;
use crate::quantity::format::{cell, list};

/// R-hat above which a large part of the variance, about a sixth, is variance between the chains.
const APART: f64 = 1.1;
/// Smallest effective sample size for the search of combinations. For fewer effective draws, the sampling error of
/// variances exceeds the thresholds of the search.
const ENOUGH_FOR_A_COVARIANCE: f64 = 100.0;

pub(super) fn find(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
    modes: &Separate,
    names: &ShownNames,
    warnings: &mut Warnings,
) {
    let factors = factors(posterior);
    let identifiability: Vec<Identifiability> = identifiability
        .iter()
        .filter(|row| !factors.contains(quantity(&row.name)))
        .cloned()
        .collect();
    let identifiability = &identifiability[..];
    let together = undetermined(posterior, rows, identifiability);
    let of_these = |row: &Identifiability| {
        together.iter().flat_map(|set| &set.members).any(|&k| identifiability[k].name == row.name)
    };
    // if chains exchange the labels of mixture components, the posterior is as wide as the prior, even if each mode
    // is well informed
    let has_modes = |row: &Identifiability| modes.iter().any(|(element, _)| *element == row.name);
    // exclude widened posteriors, which are informed by the data, and combinations, which have a separate warning
    for (label, words) in [
        (Identification::Not, "The data did not inform (contraction below 0.1): "),
        (Identification::Weakly, "The data informed only weakly (contraction below 0.5): "),
    ] {
        let rows = identifiability
            .iter()
            .filter(|r| r.label() == label && !r.widened())
            .filter(|r| !of_these(r) && !has_modes(r));
        let items =
            rows.map(|row| format!("{} ({:.2})", names.shown(&row.name), row.contraction()));
        warnings.add(
            WarningKind::Uninformed,
            words,
            &list(items),
            "The posterior of these parameters is mostly the prior; measure a quantity that depends \
             on them, or report them as assumptions",
        );
    }

    let sets = together.iter().map(|Combination { members, correlation }| {
        let names = members.iter().map(|&k| names.shown(&identifiability[k].name).to_owned());
        let names: Vec<String> = names.collect();
        match names.as_slice() {
            [a, b] => format!("{a} and {b} (correlation {correlation:.2})"),
            all => {
                format!("{} (largest correlation {correlation:.2})", list(all.iter().cloned()))
            }
        }
    });
    warnings.add(
        WarningKind::Combination,
        "The data determine only a combination of ",
        &sets.collect::<Vec<_>>().join("; of "),
        "Only the prior determines the single parameters: fix one of them, use an informative \
         prior for one of them, or parametrise the model by the combination",
    );

    // a posterior can be wide because the chains disagree; this is no conflict of prior and data
    let apart: BTreeSet<&str> =
        rows.iter().filter(|row| row.rhat > APART).map(|row| row.place.as_str()).collect();
    let widened = identifiability.iter().filter(|row| row.conflict());
    let widened = widened.filter(|row| !apart.contains(row.name.as_str())).map(|row| {
        let name = names.shown(&row.name);
        let (measure, [before, after]) = match row.halves {
            Some(halves) => ("central half", halves),
            None => ("sd", [row.prior[1], row.posterior[1]]),
        };
        format!("{name} ({measure} {} after {})", cell(after), cell(before))
    });
    warnings.add(
        WarningKind::PriorDataConflict,
        "The posterior is wider than the prior: ",
        &list(widened),
        "The data favour values that the prior considers improbable: check whether the prior is \
         meant to exclude them",
    );

    let truncated = identifiability.iter().filter(|row| row.truncated());
    let truncated = truncated.map(|row| format!("{} ({})", names.shown(&row.name), row.cuts()));
    warnings.add(
        WarningKind::Boundary,
        "Draws pile up at a prior bound: ",
        &list(truncated),
        "The prior truncates the posterior: widen the prior if the bound is not physical",
    );
}

/// Finds groups of parameters for which the data determine only a combination. Parameters with several modes or few
/// effective draws are excluded, because their covariance is not meaningful.
fn undetermined(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
) -> Vec<Combination> {
    if identifiability.len() > MOST_COMBINED {
        return Vec::new();
    }
    let Some(prior) = &posterior.prior else {
        return Vec::new();
    };
    let after = &posterior.posterior;
    let columns: Option<Vec<BeforeAndAfter>> = identifiability
        .par_iter()
        .map(|Identifiability { name, .. }| {
            let posterior = after.trace(name)?.concat();
            let finite = posterior.iter().all(|x| x.is_finite());
            let prior = prior.trace(name)?.concat();
            finite.then_some(BeforeAndAfter { prior, posterior })
        })
        .collect();
    let columns = columns.unwrap_or_default();
    let enough: BTreeSet<&str> = rows
        .iter()
        .filter(|row| row.ess() >= ENOUGH_FOR_A_COVARIANCE)
        .map(|row| row.place.as_str())
        .collect();
    let fit = |&k: &usize| {
        let chains: Vec<&[f64]> = columns[k].posterior.chunks(after.draws).collect();
        enough.contains(identifiability[k].name.as_str()) && Modes::find(&chains).is_none()
    };
    let mut sets = combinations(&columns);
    sets.retain(|set| set.members.iter().all(fit));
    sets
}

/// Returns the names of the quantities that are Cholesky factors. They are excluded from the warnings, because single
/// entries of a factor have no simple meaning.
fn factors(posterior: &Posterior) -> BTreeSet<&str> {
    let group = &posterior.posterior;
    let is_triangular = |values: &&Values| match values.shape[..] {
        [.., rows, columns] if rows == columns && columns > 1 => {
            group.column(values, columns - 1).iter().all(|x| *x == 0.0)
        }
        _ => false,
    };
    group.variables.iter().filter(is_triangular).map(|values| values.name.as_str()).collect()
}

/// Returns the name of the quantity from the name of its element, `name[index]`.
fn quantity(name: &str) -> &str {
    name.split_once('[').map_or(name, |(quantity, _)| quantity)
}
