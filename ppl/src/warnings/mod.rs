//! What is wrong with a run, in words, and what to try.

mod convergence;
mod hamiltonian;
mod information;
mod list;
pub(crate) mod stuck;

use crate::diagnostics::Identifiability;
use crate::posterior::{Posterior, SummaryRow};
use crate::words;
use list::{Names, Warnings};
pub use list::{Warning, WarningKind};

/// All that is to be said of a posterior.
pub(crate) fn warnings(
    posterior: &Posterior,
    rows: &[SummaryRow],
    identifiability: &[Identifiability],
) -> Vec<Warning> {
    let mut warnings = Warnings::default();
    let names = Names::new(rows);
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
    // without data there is nothing that a posterior could have learned
    if are_together && posterior.has_likelihood() {
        information::find(posterior, rows, identifiability, &modes, &names, &mut warnings);
    }
    model(posterior, &mut warnings);
    warnings.0
}

/// What the model's statements refused.
fn model(posterior: &Posterior, warnings: &mut Warnings) {
    let rejections = posterior.rejections();
    let after =
        rejections.iter().filter(|(_, counts)| counts.1 > 0).map(|(place, (warmup, sampling))| {
            format!("{sampling} at {place} (and {warmup} in the warmup)")
        });
    warnings.add(
        WarningKind::Rejections,
        "Points were rejected because a statement has no density there: ",
        &words::list(after),
        "Harmless if rare and at the edge of the support; otherwise the statement's support does \
         not fit the unknowns' priors",
    );
    let places = posterior.unpredicted.iter().map(|(place, count)| format!("{count} at {place}"));
    warnings.add(
        WarningKind::Unpredicted,
        "Draws without prediction (their values are NaN): ",
        &words::list(places),
        "A prediction's parameters left their domain; check the statement",
    );
}
