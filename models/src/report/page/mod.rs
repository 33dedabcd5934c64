//! Report page of a case.

mod answer;
mod confirmation;
mod data;
mod further;
pub(super) mod parts;
mod posterior;

use maud::{Markup, html};

use parts::{captioned, facts};

use super::document::document;
use super::results::Results;

/// Returns the report as HTML, with inline figures.
pub(crate) fn page(results: &Results) -> String {
    let content = html! {
        (unfinished(results))
        @if !results.parameters.is_empty() {
            (answer::parameters(results))
            (answer::warnings(results))
            (answer::budget(results))
        }
        @if !results.pictures.is_empty() || !results.mesh_facts.is_empty() {
            (specimen(results))
        }
        @if !results.ensemble.is_empty() || !results.experiments.is_empty() {
            (data::curves(results))
        }
        @if !results.orders.is_empty() { (data::surrogate(results)) }
        @if !results.parameters.is_empty() {
            (posterior::posterior(results))
            (posterior::sampling(results))
            (posterior::predictions(results))
        }
        @if !results.map_curve.is_empty() {
            (confirmation::confirmation(results))
            (confirmation::damage(results))
            (further::further(results))
        }
        (details(results))
    };
    document(&results.title, "figure", &content)
}

/// Section with the state of all stages, if a stage is not finished.
fn unfinished(results: &Results) -> Markup {
    if results.unfinished.is_empty() {
        return html! {};
    }
    let missing: Vec<&str> = results
        .unfinished
        .iter()
        .filter(|[_, state, _]| state != "done")
        .map(|[stage, ..]| stage.as_str())
        .collect();
    html! {
        section {
            h2 { "Not finished" }
            p { "This page shows what there was when it was written. Missing: " (missing.join(", ")) ". "
                code { "breccia report" } " writes it again." }
            (parts::table(
                html! { th { "stage" } th.text { "state" } th.text {} },
                html! { @for [stage, state, told] in &results.unfinished { tr {
                    td.name { (stage) } td.name { (state) } td.text { (told) }
                } } },
            ))
            @if results.parameters.is_empty() && !results.notes.is_empty() {
                ul { @for text in &results.notes { li { (text) } } }
            }
        }
    }
}

fn specimen(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Specimen" }
            div.gallery {
                @for picture in &results.pictures { (captioned(&picture.content, &picture.caption)) }
            }
            div.gallery {
                @if !results.image_facts.is_empty() {
                    div { h3 { "Image" } (facts(&results.image_facts)) }
                }
                @if !results.mesh_facts.is_empty() {
                    div { h3 { "Mesh" } (facts(&results.mesh_facts)) }
                }
            }
        }
    }
}

fn details(results: &Results) -> Markup {
    html! {
        section {
            h2 { "How it was made" }
            (facts(&results.settings))
            details {
                summary { "The case file, with every default filled in" }
                pre { (results.case_toml) }
            }
        }
    }
}
