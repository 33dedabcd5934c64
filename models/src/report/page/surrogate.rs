//! Section on the prior, the design and the surrogate.

use maud::{Markup, html};

use super::parts::{figure, pairs, table};
use crate::report::figures;
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.orders.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Prior, design and surrogate" }
            @if results.parameters.iter().any(|p| !p.design.is_empty()) {
                (pairs(&figures::design(&results.parameters), html! {
                    "The simulations of the ensemble. The axes span the prior box. Diagonal: distribution of the \
                     simulations, and the prior (dashed). Below: contours that enclose 10, 50 and 90 % of the \
                     simulations. Above: the points."
                }, "in an empty part of the box there are no runs, so that the surrogate is unreliable there: check for failed \
                    runs above, or increase design.runs."))
            }
            p { "Polynomial chaos of order " strong { (results.chosen_order) } ": "
                (results.order_rule) "." }
            (figure(&figures::orders(results), html! {
                "Errors relative to the variance of each quantity, averaged over the quantities. Errors of orders \
                 with more terms than runs cannot be estimated."
            }, "an error above some per cent at the chosen order widens the intervals: increase design.runs. A \
                training error far below the validation error means too few runs for the order."))
            (table(
                html! {
                    th { "total Sobol index" }
                    @for p in &results.parameters { th { (p.label) } }
                    @for name in &results.known_inputs { th { (name) } }
                },
                html! { @for qoi in &results.qois { tr {
                    td.name { (qoi.label) }
                    @for (index, ends) in &qoi.sobol_total {
                        td { (format!("{index:.3}"))
                            @if let Some([low, high]) = ends { small { (format!("{low:.3} … {high:.3}")) } }
                        }
                    }
                } } },
            ))
            p.caption { "Fraction of each quantity's variance over the prior box that involves the \
                         parameter, with a 90 % interval for the limited number of runs. A parameter \
                         with small indices cannot be identified." }
        }
    }
}
