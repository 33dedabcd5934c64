//! Section with the warnings of all stages and the notes on the results.

use maud::{Markup, html};

use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.parameters.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Warnings" }
            @if results.warnings.is_empty() {
                p.good { "No stage has warned." }
            } @else {
                ul.warnings { @for text in &results.warnings { li { (text) } } }
            }
            @if !results.notes.is_empty() {
                ul { @for text in &results.notes { li { (text) } } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_without_warnings_says_so_and_one_with_warnings_does_not() {
        let quiet = show(&Results::default()).into_string();
        assert!(quiet.contains("No stage has warned."), "{quiet}");
        let warned = Results { warnings: vec!["The fit is poor".into()], ..Results::default() };
        let html = show(&warned).into_string();
        assert!(html.contains("<li>The fit is poor</li>") && !html.contains("No stage"), "{html}");
    }
}
