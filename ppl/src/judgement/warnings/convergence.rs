//! Warnings about convergence: stopped chains, R-hat, modes and effective sample size.

use rayon::prelude::*;

use crate::diagnostics::Modes;
use crate::judgement::warnings::list::{ShownNames, WarningKind, Warnings};
use crate::posterior::Posterior;
use crate::posterior::SummaryRow;
use crate::quantity::draws::Values;
use crate::quantity::format::{cell, list};
use crate::quantity::record::Role;

/// Parameters whose posterior has several modes between which the chains do not mix: name with indices, and modes.
pub(super) type Separate = Vec<(String, Modes)>;

/// Adds warnings about stopped chains, about draws from another density, and about draws that are not finite.
pub(super) fn find(posterior: &Posterior, rows: &[SummaryRow], warnings: &mut Warnings) {
    let runs = &posterior.chains.chains;
    for (chain, run) in runs.iter().enumerate() {
        if let Some(reason) = &run.stopped {
            warnings.add(
                WarningKind::Stopped,
                &format!("Chain {chain} ended after {} draws: ", run.len()),
                &reason.to_string(),
                "All chains were shortened to the length of the shortest chain; remove the cause \
                 and run again before using the result",
            );
        }
    }

    if posterior.is_foreign {
        warnings.add(
            WarningKind::OtherDensity,
            "The draws are from another density",
            " than the density of this model",
            "This is correct if the data were held out; otherwise use the model and the data with \
             which the chains were drawn",
        );
    }

    let not_finite = rows.iter().filter(|r| !r.mean.is_finite()).map(|r| r.name.clone());
    warnings.add(
        WarningKind::NotFinite,
        "Some draws are NaN or infinite: ",
        &list(not_finite),
        "Look for a logarithm, root or division at the edge of its domain",
    );
}

/// Adds warnings from the comparison of chains. Called only if no chain is stuck.
pub(super) fn compare(
    posterior: &Posterior,
    rows: &[SummaryRow],
    modes: &Separate,
    names: &ShownNames,
    warnings: &mut Warnings,
) {
    let runs = &posterior.chains.chains;
    let mut split: Vec<&SummaryRow> = rows.iter().filter(|r| r.rhat > 1.01).collect();
    split.sort_by(|a, b| b.rhat.total_cmp(&a.rhat));
    warnings.add(
        WarningKind::Disagreement,
        "The chains do not agree yet (R-hat above 1.01): ",
        &list(split.iter().map(|r| format!("{} ({:.3})", r.name, r.rhat))),
        "Run longer chains; if this does not help, look for several modes, or for parameters of \
         which the data determine only a combination, and reparametrise or use stronger priors",
    );

    warnings.add(
        WarningKind::Modes,
        "The posterior seems to have several modes: ",
        &list(modes.iter().map(|(element, modes)| in_words(names.shown(element), modes))),
        "The fraction of draws in a mode depends on the starting points of the chains and is not \
         the probability of the mode: exclude modes by a stronger prior (or by an order constraint, \
         if the modes differ only by exchanged labels), or report each mode separately; if only one \
         mode is relevant, start all chains there (`Map`, then `init_points`)",
    );

    // for a single draw the sd is NaN, although the quantity may vary
    let moves = |r: &&SummaryRow| r.q05 != r.q95 || r.sd.is_nan();
    let unknown =
        rows.iter().filter(|r| r.mean.is_finite() && (r.rhat.is_nan() || r.ess().is_nan()));
    warnings.add(
        WarningKind::FewEffectiveDraws,
        &format!(
            "{} draws per chain are too few to estimate R-hat and the effective sample size of: ",
            posterior.posterior.draws
        ),
        &list(unknown.filter(moves).map(|r| r.name.clone())),
        "Draw more, for example 1000 draws per chain",
    );

    let enough = 100.0 * runs.len() as f64;
    let mut few: Vec<&SummaryRow> = rows.iter().filter(|r| r.ess() < enough).collect();
    few.sort_by(|a, b| a.ess().total_cmp(&b.ess()));
    warnings.add(
        WarningKind::FewEffectiveDraws,
        &format!("Effective sample size below {enough:.0} (100 per chain): "),
        &list(few.iter().map(|r| format!("{} ({:.0})", r.name, r.ess()))),
        "Draw more; means, intervals and R-hat of these quantities are not reliable",
    );
}

/// Finds the parameters whose posterior has separate modes between which the chains do not mix.
pub(super) fn separate_modes(posterior: &Posterior) -> Separate {
    let group = &posterior.posterior;
    let parameters: Vec<_> = posterior
        .layout
        .with_role(Role::Parameter)
        .filter_map(|variable| group.get(&variable.name))
        .flat_map(|values| {
            values.elements().into_iter().enumerate().map(move |(k, element)| (values, k, element))
        })
        .collect();
    let modes = |(values, index, element): (&Values, usize, String)| {
        let draws = group.column(values, index);
        let chains: Vec<&[f64]> = draws.chunks(group.draws).collect();
        let modes = Modes::find(&chains).filter(|modes| !modes.mixed())?;
        Some((element, modes))
    };
    parameters.into_par_iter().filter_map(modes).collect()
}

fn in_words(name: &str, modes: &Modes) -> String {
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
    format!("{name} has {count}, near {places}, with {changes} changes between them")
}
