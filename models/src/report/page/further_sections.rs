//! Sections that a program of the user adds.

use maud::{Markup, PreEscaped, html};

use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&[(&'static str, String)]> {
    (!results.further_sections.is_empty()).then_some(&results.further_sections)
}

pub(super) fn show(sections: &[(&'static str, String)]) -> Markup {
    html! {
        @for (title, content) in sections {
            section { h2 { (title) } (PreEscaped(content)) }
        }
    }
}
