//! Sections on the posterior, its sampling and its predictions.

use maud::{Markup, PreEscaped, html};

use super::parts::{figure, pairs, panels, table};
use crate::report::digits::within;
use crate::report::figures;
use crate::report::results::{LeftOut, MOST_SHIFT, Results};

pub(super) fn posterior(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Posterior" }
            (pairs(&figures::posterior(&results.parameters), html! {
                "Axes span the prior box. Diagonal: posterior (red) and prior (dashed), MAP \
                 dotted. Below: contours that enclose 10, 50 and 90 % of the mass. Above: draws. "
                @if results.parameters.iter().any(|p| p.truth.is_some()) {
                    "Green: the truth of the virtual specimens."
                }
            }))
            (table(
                html! {
                    th { "quantity" } th { "mean" } th { "sd" } th { "5 %" } th { "50 %" } th { "95 %" }
                    th { "R̂" } th { "ESS, bulk" } th { "ESS, tail" }
                },
                html! { @for row in &results.summary { tr {
                    td.name { (row.name) }
                    @for moment in row.moments { td { (within(moment)) } }
                    td { (or_dash(row.rhat, 3)) }
                    td { (or_dash(row.ess_bulk, 0)) }
                    td { (or_dash(row.ess_tail, 0)) }
                } } },
            ))
            p.caption {
                "Digits that the Monte Carlo error allows. Scatter between specimens (sd) is relative \
                 to their means."
            }
        }
    }
}

fn or_dash(x: f64, decimals: usize) -> String {
    if x.is_finite() { format!("{x:.decimals$}") } else { "–".to_owned() }
}

pub(super) fn sampling(results: &Results) -> Markup {
    let chains = results.parameters.iter().map(|p| p.chains.len()).max().unwrap_or(0);
    let draws = results.parameters.iter().map(|p| p.draws().count()).max().unwrap_or(0);
    html! {
        section {
            h2 { "Sampling" }
            p {
                (draws) " draws in " (chains) " chains. "
                @match results.divergences {
                    0 => span.good { "No divergent transitions." },
                    n => span.bad { (n) " divergent transitions: the posterior has a part that the \
                                     sampler did not reach." },
                }
            }
            (panels(&figures::ranks(&results.parameters), html! {
                "Ranks of each chain's draws among the draws of all chains, one colour for each chain: uniform \
                 if the chains agree."
            }))
            figure {
                @for trace in figures::traces(&results.parameters) { (PreEscaped(trace)) }
                figcaption { "Draws in order, one colour for each chain." }
            }
        }
    }
}

pub(super) fn predictions(results: &Results) -> Markup {
    let predicted = figures::predictive(results);
    let curves = figures::predicted(results);
    if predicted.is_empty() && curves.is_none() && results.loo.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "Prediction against experiment" }
            @if let Some(svg) = &curves {
                (figure(svg, html! {
                    "Predicted curve of a new specimen: at each displacement the bands contain 50 and 90 % of the \
                     predictions. Height and width are drawn from the posterior, with the scatter between \
                     specimens and the error that all share; the shape is that of the runs at the same parameters, with \
                     the scatter of the experiments' shapes. Dashed: the experiments."
                }))
            }
            @if !predicted.is_empty() {
                (panels(&predicted, html! {
                    "Bars: predictions for a new specimen, 99 % of the draws. Outline and dots: the \
                     experiments; dashed: their mean."
                }))
            }
            (left_out(&results.loo))
        }
    }
}

/// Table of leave-one-out predictions of the specimens.
fn left_out(loo: &[LeftOut]) -> Markup {
    if loo.is_empty() {
        return html! {};
    }
    let total: f64 = loo.iter().map(|one| one.elpd).sum();
    let sampled = loo.iter().filter(|one| one.is_sampled).count();
    html! {
        h3 { "Each specimen left out in turn" }
        (table(
            html! {
                th { "specimen" } th { "log predictive density" } th { "Pareto k̂" }
                th { "largest shift, sd" } th.text { "of" } th {}
            },
            html! {
                @for one in loo { tr {
                    td.name { (one.specimen) }
                    td { (format!("{:.2}", one.elpd)) }
                    td { (format!("{:.2}", one.pareto_k)) }
                    @if let Some((parameter, shift)) = &one.moved {
                        td { (format!("{shift:+.2}")) }
                        td.name { (parameter) }
                        td { @if shift.abs() > MOST_SHIFT { span.verdict.weak { "look at it" } } }
                    } @else { td {} td {} td {} }
                } }
                tr { td.name { "all" } td { (format!("{total:.2}")) } td {} td {} td {} td {} }
            },
        ))
        p.caption {
            "A specimen with a density far below that of the others differs from them. The shift is that of a \
             parameter's posterior mean if the specimen is removed, in posterior standard deviations. "
            @if sampled == 0 {
                "Computed by Pareto-smoothed importance weights (PSIS-LOO)."
            } @else {
                "Computed by Pareto-smoothed importance weights (PSIS-LOO), or by a calibration without the specimen \
                 if k̂ is too large for them (" (sampled) " of " (loo.len()) ")."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::CalibratedParameter;

    fn left(shift: f64, is_sampled: bool) -> LeftOut {
        LeftOut {
            specimen: "V-01".into(),
            elpd: 4.25,
            pareto_k: 0.9,
            moved: Some(("E (MPa)".into(), shift)),
            is_sampled,
        }
    }

    #[test]
    fn a_specimen_that_moves_a_parameter_is_marked_whatever_its_k() {
        let html = left_out(&[left(-0.99, true), left(-1.01, true)]).into_string();
        assert_eq!(html.matches("look at it").count(), 1, "{html}");
        assert!(html.contains("8.50"), "the sum: {html}");
        assert!(html.contains("(2 of 2)"), "{html}");
        assert!(
            left_out(&[left(0.3, false)])
                .into_string()
                .contains("Computed by Pareto-smoothed importance weights (PSIS-LOO).")
        );
        assert_eq!(left_out(&[]).into_string(), "");
    }

    #[test]
    fn divergences_are_said_and_so_is_that_there_are_none() {
        let chains = vec![vec![1.0, 2.0, 4.0], vec![3.0, 1.5, 2.5]];
        let parameter = CalibratedParameter { chains, ..Default::default() };
        let mut results = Results { parameters: vec![parameter], ..Results::default() };
        let html = sampling(&results).into_string();
        assert!(html.contains("6 draws in 2 chains") && html.contains("No divergent transitions"));
        results.divergences = 3;
        assert!(sampling(&results).into_string().contains("3 divergent transitions"));
    }
}
