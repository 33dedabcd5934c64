//! Warnings about Hamiltonian Monte Carlo: energy, divergences and tree depth.

use rayon::prelude::*;

use crate::diagnostics::{e_bfmi, quantile};
use crate::judgement::warnings::list::{ShownNames, WarningKind, Warnings};
use crate::posterior::Posterior;
use crate::quantity::format::{cell, list};
use crate::sampler::Chain;

pub(super) fn find(posterior: &Posterior, names: &ShownNames, warnings: &mut Warnings) {
    let runs = &posterior.chains.chains;
    let total = posterior.chains.len() * runs.len();
    let low = runs.iter().enumerate().filter_map(|(chain, run)| {
        let energy: Vec<f64> = run.stats.iter().map(|s| s.energy).collect();
        let fraction = e_bfmi(&energy);
        (fraction < 0.3).then(|| format!("chain {chain} ({fraction:.2})"))
    });
    warnings.add(
        WarningKind::Energy,
        "Energy changes too little from draw to draw (E-BFMI below 0.3): ",
        &list(low),
        "Heavy tails or a funnel: reparametrise (non-centred) or give stronger priors to scales",
    );

    let divergences = posterior.chains.divergences();
    // a point that the density rejects has an infinite energy error; rejections after the warmup are also counted per
    // statement
    let errors = runs.iter().flat_map(|run| &run.divergences).map(|d| d.energy_error);
    let rejected = errors.filter(|error| !error.is_finite()).count();
    let counted: u64 = posterior.rejections().values().map(|counts| counts.1).sum();
    if divergences > 0 && rejected == divergences && counted >= rejected as u64 {
        let location = where_divergences_are(posterior, names);
        warnings.add(
            WarningKind::Divergences,
            &format!("{divergences} of {total} trajectories "),
            &format!("ended at a point that a statement rejects{location}"),
            "A smaller step size does not help, and draws near these points are missing: choose \
             priors (`truncate`) or a parametrisation (a logarithm) that keep the unknowns where \
             the density of the statement is positive",
        );
    } else if divergences > 0 {
        let location = where_divergences_are(posterior, names);
        let of_these = match rejected {
            0 => String::new(),
            n => format!(" ({n} of them at a point with zero or undefined density)"),
        };
        warnings.add(
            WarningKind::Divergences,
            &format!("{divergences} of {total} trajectories "),
            &format!("diverged{of_these}{location}"),
            too_curved(runs),
        );
    }

    let limit = posterior.chains.max_depth;
    let cut = runs.iter().flat_map(|run| &run.stats).filter(|s| Some(s.depth) == limit).count();
    if cut * 100 > total {
        warnings.add(
            WarningKind::TreeDepth,
            &format!("{cut} of {total} trajectories reached the maximum tree depth "),
            &format!("(mass matrix: {})", maps(runs)),
            "Sampling is slow but not wrong: a longer warmup or a reparametrisation shortens the \
             trajectories",
        );
    }
}

/// Kinds of mass matrix of the chains, without duplicates.
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

/// Advice for divergent trajectories, given the target acceptance probability of the run.
fn too_curved(runs: &[Chain]) -> &'static str {
    let target = runs.iter().map(|run| run.warmup.target_acceptance).fold(0.0, f64::max);
    if target < 0.95 {
        "The curvature of the posterior there is too large for the step size, and draws are \
         missing: raise the target acceptance (to 0.95, then 0.99), use the slower warmup of \
         `Nuts::stan_compatible`, or reparametrise"
    } else if target < 0.99 {
        "The curvature of the posterior there is too large for the step size, and draws are \
         missing: raise the target acceptance to 0.99, use the slower warmup of \
         `Nuts::stan_compatible`, or reparametrise"
    } else {
        "The curvature of the posterior there is too large for every practical step size, and \
         draws are missing: reparametrise, or use stronger priors"
    }
}

/// Describes the location of the divergences by the two parameters whose median over the divergences is farthest from
/// the posterior median. The distance is measured in units of the interquartile range, because a parameter with heavy
/// tails may have no standard deviation.
fn where_divergences_are(posterior: &Posterior, names: &ShownNames) -> String {
    let divergences: Vec<_> =
        posterior.divergences.iter().filter(|p| !p.values.is_empty()).collect();
    let Some(first) = divergences.first() else {
        return String::new();
    };
    let mut shifts: Vec<(f64, String)> = (0..first.values.len())
        .into_par_iter()
        .filter_map(|k| {
            let name = &first.values[k].0;
            let draws = posterior.posterior.trace(name)?.concat();
            let there: Vec<f64> = divergences.iter().map(|p| p.values[k].1).collect();
            let there = quantile(&there, 0.5);
            let [lower, centre, upper] = [0.25, 0.5, 0.75].map(|p| quantile(&draws, p));
            let shift = (there - centre).abs() / (upper - lower);
            let words = || {
                let [there, centre, lower, upper] = [there, centre, lower, upper].map(cell);
                let name = names.shown(name);
                format!("{name} ≈ {there} (posterior {centre}, central half {lower} to {upper})")
            };
            shift.is_finite().then(|| (shift, words()))
        })
        .collect();
    shifts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let places: Vec<String> = shifts.into_iter().take(2).map(|(_, words)| words).collect();
    if places.is_empty() {
        String::new()
    } else {
        format!("; median of these points: {}", places.join(" and "))
    }
}
