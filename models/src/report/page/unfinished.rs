//! Section with the state of all stages, if a stage is not finished.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.unfinished.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let missing: Vec<&str> = results
        .unfinished
        .iter()
        .filter(|[_, state, _]| state != "done")
        .map(|[stage, ..]| stage.as_str())
        .collect();
    html! {
        section {
            h2 { "Not finished" }
            p { "This page shows the results that existed when the page was written. Missing: " (missing.join(", ")) ". "
                code { "breccia report" } " writes the page again." }
            (table(
                html! { th { "stage" } th.text { "state" } th.text {} },
                html! { @for [stage, state, progress] in &results.unfinished { tr {
                    td.name { (stage) } td.name { (state) } td.text { (progress) }
                } } },
            ))
            @if results.parameters.is_empty() && !results.notes.is_empty() {
                ul { @for text in &results.notes { li { (text) } } }
            }
        }
    }
}
