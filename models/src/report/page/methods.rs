//! Methods paragraph for a paper, with the settings and diagnostics of this run and its references.

use maud::{Markup, html};

use crate::report::results::{Methods, Results};

/// Settings of the run, and numbers from its results.
pub(super) struct Paragraph<'a> {
    settings: &'a Methods,
    specimens: usize,
    runs: usize,
    order: usize,
    parameters: Vec<String>,
    quantities: Vec<&'a str>,
    /// Largest R-hat and smallest bulk ESS of all sampled quantities.
    rhat: f64,
    ess: f64,
    divergences: u64,
}

pub(super) fn collect(results: &Results) -> Option<Paragraph<'_>> {
    let settings = results.methods.as_ref()?;
    if results.parameters.is_empty() {
        return None;
    }
    let parameters =
        results.parameters.iter().map(|p| format!("{} ({})", p.label, p.prior_words()));
    let summary_rows = || results.summary.iter();
    Some(Paragraph {
        settings,
        specimens: results.experiments.len().max(results.specimens.len()),
        // runs may have quantities and no curves
        runs: results
            .qois
            .iter()
            .map(|q| q.ensemble.len())
            .fold(results.ensemble.len(), usize::max),
        order: results.chosen_order,
        parameters: parameters.collect(),
        quantities: results.qois.iter().map(|qoi| qoi.label.as_str()).collect(),
        rhat: summary_rows().map(|row| row.rhat).fold(f64::NEG_INFINITY, f64::max),
        ess: summary_rows().map(|row| row.ess_bulk).fold(f64::INFINITY, f64::min),
        divergences: results.divergences,
    })
}

pub(super) fn show(paragraph: &Paragraph<'_>) -> Markup {
    let Paragraph { settings, specimens, runs, order, rhat, ess, divergences, .. } = paragraph;
    let Methods { damage, elements, design, terms, chains, warmup, draws, thinning, .. } = settings;
    html! {
        section {
            h2 { "Methods, for a paper" }
            p {
                "The parameters " (paragraph.parameters.join("; ")) " (in brackets: the range of the prior) were \
                 calibrated against " (paragraph.quantities.join(", ")) " of " (specimens) " specimens with Breccia "
                (settings.version) ", following Schmid et al. [1]. "
                @match (&settings.outside, damage) {
                    (Some(outside), _) => { (outside) " " }
                    (None, Some(damage)) => {
                        "Each specimen was simulated with " (elements) " finite elements and a phase-field model of fracture [2, 3] (" (damage.model) ", split of the energy: "
                        (damage.split) ", irreversibility: " (damage.irreversibility) ", regularisation length "
                        (damage.length_mm) " mm). "
                    }
                    (None, None) => {
                        "Each specimen was simulated with " (elements) " finite elements, without damage. "
                    }
                }
                (runs) " simulations"
                @if !design.is_empty() {
                    ", placed in the ranges of the priors by the method " (design) ","
                }
                " were replaced by a polynomial chaos expansion [4] of order " (order) " (" (terms) " terms; "
                (settings.order_rule) "). The specimens scatter about the model by a multivariate normal distribution with \
                 an LKJ(3) prior on its correlations [5] and Normal(0.15, 0.25) priors, truncated to positive values, on \
                 the standard deviations relative to the means. The error of surrogate and mesh \
                 correction is shared by all specimens. The posterior was sampled with the No-U-Turn sampler [6] in " (chains)
                " chains of " (warmup) " warmup and " (draws) " kept steps" (thinning) " (target acceptance "
                (settings.target_accept) ", seed " (settings.seed) "). "
                @if rhat.is_finite() && ess.is_finite() {
                    "The largest rank-normalised split R̂ [7] is " (format!("{rhat:.3}"))
                    ", the smallest bulk effective sample size " (format!("{ess:.0}")) "; "
                }
                (divergences) " transitions after warmup diverged. Intervals are 90 % intervals between the 5 % and the \
                 95 % quantile."
            }
            ol.references { @for (text, doi) in REFERENCES { li {
                (text)
                @if let Some(doi) = doi { " " a href={ "https://doi.org/" (doi) } { "doi:" (doi) } "." }
            } } }
        }
    }
}

/// References in the order of their numbers: text and DOI.
const REFERENCES: [(&str, Option<&str>); 7] = [
    (
        "Schmid et al.: Calibrating a Finite-strain Phase-field Model of Fracture for Bonded Granular Materials with \
         Uncertainty Quantification.",
        None,
    ),
    (
        "Bourdin, Francfort, Marigo: Numerical experiments in revisited brittle fracture. Journal of the Mechanics and \
         Physics of Solids 48 (2000) 797–826.",
        Some("10.1016/S0022-5096(99)00028-9"),
    ),
    (
        "Miehe, Hofacker, Welschinger: A phase field model for rate-independent crack propagation: robust algorithmic \
         implementation based on operator splits. Computer Methods in Applied Mechanics and Engineering 199 (2010) \
         2765–2778.",
        Some("10.1016/j.cma.2010.04.011"),
    ),
    (
        "Blatman, Sudret: Adaptive sparse polynomial chaos expansion based on least angle regression. Journal of \
         Computational Physics 230 (2011) 2345–2367.",
        Some("10.1016/j.jcp.2010.12.021"),
    ),
    (
        "Lewandowski, Kurowicka, Joe: Generating random correlation matrices based on vines and extended onion method. \
         Journal of Multivariate Analysis 100 (2009) 1989–2001.",
        Some("10.1016/j.jmva.2009.04.008"),
    ),
    (
        "Hoffman, Gelman: The No-U-Turn Sampler: adaptively setting path lengths in Hamiltonian Monte Carlo. Journal of \
         Machine Learning Research 15 (2014) 1593–1623.",
        None,
    ),
    (
        "Vehtari, Gelman, Simpson, Carpenter, Bürkner: Rank-normalization, folding, and localization: an improved R̂ for \
         assessing convergence of MCMC. Bayesian Analysis 16 (2021) 667–718.",
        Some("10.1214/20-BA1221"),
    ),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::{CalibratedParameter, DamageModel, Summarised};

    #[test]
    fn the_paragraph_has_the_numbers_of_the_run_and_cites_every_reference() {
        let damage = DamageModel {
            model: "at2".into(),
            split: "none".into(),
            irreversibility: "history".into(),
            length_mm: 0.06,
        };
        let row = |rhat, ess_bulk| Summarised { rhat, ess_bulk, ..Summarised::default() };
        let results = Results {
            methods: Some(Methods {
                version: "9.8.7".into(),
                damage: Some(damage),
                elements: "quadratic".into(),
                chains: 4,
                warmup: 321,
                draws: 654,
                target_accept: 0.8,
                ..Methods::default()
            }),
            parameters: vec![CalibratedParameter { label: "E (MPa)".into(), ..Default::default() }],
            ensemble: vec![Vec::new(); 37],
            chosen_order: 3,
            summary: vec![row(1.001, 900.0), row(1.012, 456.0)],
            divergences: 2,
            ..Results::default()
        };
        let html = collect(&results).map(|values| show(&values).into_string()).unwrap_or_default();
        for part in [
            "E (MPa)",
            "Breccia 9.8.7",
            "regularisation length 0.06 mm",
            "37 simulations",
            "order 3",
            "4 chains of 321 warmup and 654 kept",
            "is 1.012,",
            "sample size 456;",
            "2 transitions",
        ] {
            assert!(html.contains(part), "{part}: {html}");
        }
        for number in 1..=REFERENCES.len() {
            let cited = [format!("[{number}"), format!(", {number}]")];
            assert!(cited.iter().any(|cited| html.contains(cited)), "[{number}]: {html}");
        }
        assert!(collect(&Results::default()).is_none());
    }
}
