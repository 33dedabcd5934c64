//! Section with the image and the mesh of the specimen.

use maud::{Markup, html};

use super::parts::{facts, picture};
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.pictures.is_empty() || !results.mesh_facts.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Image and mesh of the specimen" }
            div.gallery {
                @for shown in &results.pictures { (picture(shown)) }
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
