//! What was measured, what the ensemble reaches, and the surrogate.

use maud::{Markup, html};

use super::{figure, panels, table};
use crate::report::figures;
use crate::report::results::Results;

pub(super) fn curves(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Curves and quantities of interest" }
            (figure(&figures::curves(results), html! {
                (results.ensemble.len()) " simulated tests over the prior box ("
                (format!("{:.0}", results.ensemble_seconds)) " s of processor time), "
                (results.experiments.len()) " measured ones. The ensemble has to bound the \
                experiments."
            }))
            @if !results.failures.is_empty() {
                p { "Runs that failed and are left out:" }
                ul { @for (id, reason) in &results.failures { li { "run " (id) ": " (reason) } } }
            }
            (panels(&figures::of_the_ensemble(results), html! {
                "Bars: ensemble. Outline and dots: experiments; dashed: their mean."
            }))
            (findings(results))
        }
    }
}

/// What was seen in the measured curves.
fn findings(results: &Results) -> Markup {
    html! {
        h3 { "Looked at" }
        @if results.findings.is_empty() {
            p.good { "Nothing was found in the measured curves that one has to know." }
        } @else {
            (table(
                html! { th { "specimen" } th.text { "finding" } th.text {} },
                html! { @for f in &results.findings { tr {
                    td.name { (f.specimen) } td.name { (f.finding) } td.text { (f.help) }
                } } },
            ))
        }
    }
}

pub(super) fn surrogate(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Prior, design and surrogate" }
            @if results.parameters.iter().any(|p| !p.design.is_empty()) {
                (super::posterior::pairs(&figures::design(&results.parameters), html! {
                    "The simulations of the ensemble in the prior box, which the axes span. Diagonal: \
                     where they lie, and the prior (dashed). Below: contours that enclose 10, 50 and \
                     90 % of them. Above: the points."
                }))
            }
            p { "Polynomial chaos of order " strong { (results.chosen_order) } ": "
                (results.order_rule) "." }
            (figure(&figures::orders(results), html! {
                "Errors relative to the variance of each quantity, averaged over them. Orders \
                 with more terms than runs are not estimable."
            }))
            (table(
                html! {
                    th { "total Sobol index" }
                    @for p in &results.parameters { th { (p.label) } }
                },
                html! { @for qoi in &results.qois { tr {
                    td.name { (qoi.label) }
                    @for s in &qoi.sobol_total { td { (format!("{s:.3}")) } }
                } } },
            ))
            p.caption { "Fraction of each quantity's variance over the prior box that involves the \
                         parameter: a parameter with small indices cannot be identified." }
        }
    }
}
