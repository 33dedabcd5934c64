//! Section on the posterior: pairs of parameters, and the summary of every sampled number.

use maud::{Markup, html};

use super::parts::{pairs, table};
use crate::report::digits::within;
use crate::report::figures;
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.parameters.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Posterior" }
            (pairs(&figures::posterior(&results.parameters), html! {
                "Axes span the prior box. Diagonal: posterior (red) and prior (dashed), MAP \
                 dotted. Below: contours that enclose 10, 50 and 90 % of the mass. Above: draws. "
                @if results.parameters.iter().any(|p| p.truth.is_some()) {
                    "Green: the truth of the virtual specimens."
                }
            }, "the prior cuts contours that touch an edge: extend the prior with [[extend]]. If the posterior equals the \
                prior, the data have no information on the parameter: see the further tests."))
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
                "Numbers have the digits that the Monte Carlo error allows. Scatter between specimens (sd) is relative \
                 to the means of the specimens."
            }
        }
    }
}

fn or_dash(x: f64, decimals: usize) -> String {
    if x.is_finite() { format!("{x:.decimals$}") } else { "–".to_owned() }
}
