//! The page: one self-contained HTML file that fits a screen, a phone, paper and the dark.

mod answer;
mod confirmation;
mod data;
mod further;
mod parts;
mod posterior;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use parts::{captioned, facts};

use super::results::Results;
use super::style::named_clips;

pub(super) const STYLE: &str = include_str!("../style.css");

/// The report as HTML, figures inline.
pub(crate) fn page(results: &Results) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (results.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (results.title) }
                    (answer::parameters(results))
                    (answer::warnings(results))
                    (answer::budget(results))
                    (specimen(results))
                    (data::curves(results))
                    (data::surrogate(results))
                    (posterior::posterior(results))
                    (posterior::sampling(results))
                    (posterior::predictions(results))
                    (confirmation::confirmation(results))
                    (confirmation::damage(results))
                    (further::further(results))
                    (details(results))
                }
            }
        }
    };
    named_clips(&page.into_string(), "figure")
}

fn specimen(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Specimen" }
            div.gallery {
                @for picture in &results.pictures { (captioned(&picture.content, picture.caption)) }
            }
            div.gallery {
                @if !results.image_facts.is_empty() {
                    div { h3 { "Image" } (facts(&results.image_facts)) }
                }
                div { h3 { "Mesh" } (facts(&results.mesh_facts)) }
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
