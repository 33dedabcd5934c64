//! Warnings about a run, with advice.

mod convergence;
mod hamiltonian;
mod information;
mod list;
pub(crate) mod stuck;

use crate::diagnostics::Identifiability;
use crate::posterior::{Posterior, SummaryRow};
use crate::quantity::format;
use list::{ShownNames, Warnings};
pub use list::{Warning, WarningKind};

/// Fraction of rejected points above which rejections in the warmup or of prior draws are reported. Single rejections
/// are normal, because the first steps of a warmup are too large.
const FREQUENT: f64 = 0.01;

/// Returns all warnings about a posterior.
pub(crate) fn warnings(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
) -> Vec<Warning> {
    let mut warnings = Warnings::default();
    let names = ShownNames::new(rows);
    stuck::find(&posterior.chains, &mut warnings);
    let are_together = warnings.0.is_empty();
    convergence::find(posterior, rows, &mut warnings);
    let modes = if are_together { convergence::separate_modes(posterior) } else { Vec::new() };
    if are_together {
        convergence::compare(posterior, rows, &modes, &names, &mut warnings);
    }
    if posterior.chains.max_depth.is_some() {
        hamiltonian::find(posterior, &names, &mut warnings);
    }
    // without observations or `factor` terms, warnings about the information in the data do not apply
    if are_together && posterior.has_likelihood() {
        information::find(posterior, rows, identifiability, &modes, &names, &mut warnings);
    }
    model(posterior, &mut warnings);
    warnings.0
}

/// Adds warnings about the statements of the model: missing data, rejections and failed predictions.
fn model(posterior: &Posterior, warnings: &mut Warnings) {
    let observed = &posterior.observed.variables;
    let empty = observed.iter().filter(|v| v.data.is_empty()).map(|v| &v.name);
    let empty = empty.chain(&posterior.without_data).map(|name| format!("`{name}`"));
    let none = if posterior.has_likelihood() {
        format::list(empty)
    } else {
        "no statement `place ~ D` was executed".to_owned()
    };
    warnings.add(
        WarningKind::NoData,
        "Nothing was observed: ",
        &none,
        "Quantities that depend only on such data have draws from the prior; if there are data, \
         check whether the model received an empty slice",
    );

    let transitions: usize = posterior.chains.chains.iter().map(|c| c.warmup.stats.len()).sum();
    let frequent = (transitions as f64 * FREQUENT).max(1.0);
    let rejections = posterior.rejections();
    let shown = rejections.iter().filter(|(_, counts)| counts.1 > 0 || counts.0 as f64 > frequent);
    let after = shown.map(|(location, (warmup, sampling))| {
        format!("{sampling} at {location} (and {warmup} in the warmup)")
    });
    warnings.add(
        WarningKind::Rejections,
        "Points were rejected because the density of a statement is zero or undefined there: ",
        &format::list(after),
        "Harmless if rare and at the edge of the support; otherwise the priors allow values \
         outside the domain of the statement, such as a negative scale: use priors on the domain \
         (`HalfNormal`, `.truncate(0.0..)`), or declare the logarithm as the unknown",
    );
    let drawn = posterior.prior.as_ref().map_or(0, |prior| prior.draws) as f64;
    let refused = posterior.prior_rejections.iter().filter(|(_, n)| **n as f64 > FREQUENT * drawn);
    warnings.add(
        WarningKind::PriorOutsideDomain,
        "The prior allows values at which the density of a statement is zero or undefined; of the \
         prior draws, ",
        &format::list(refused.map(|(location, count)| {
            format!(
                "{:.0} % were rejected at {location}",
                100.0 * *count as f64 / (*count as f64 + drawn)
            )
        })),
        "Contractions are computed with the remaining prior draws; use priors on the domain \
         (`HalfNormal`, `.truncate(0.0..)`)",
    );
    let places =
        posterior.unpredicted.iter().map(|(location, count)| format!("{count} at {location}"));
    warnings.add(
        WarningKind::Unpredicted,
        "Draws without prediction (their values are NaN): ",
        &format::list(places),
        "The parameters of a prediction are outside their domain at these draws; check the statement",
    );
}
