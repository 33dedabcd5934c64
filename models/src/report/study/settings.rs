//! Section that compares the calibrations of a study under several settings.

use maud::{Markup, html};

use super::super::digits::{plain, within};
use super::super::page::parts::table;
use super::results::StudyResults;

/// Section with the intervals under all settings, side by side.
pub(super) fn settings(results: &StudyResults) -> Markup {
    if results.variants.is_empty() {
        return html! {};
    }
    let all = || {
        [(&results.title, &results.cases)]
            .into_iter()
            .chain(results.variants.iter().map(|variant| (&variant.title, &variant.cases)))
    };
    html! {
        section {
            h2 { "Intervals under each setting" }
            div.cards.tight { (table(
                html! {
                    th { "case" } th.text { "parameter" } th { "truth" }
                    @for (title, _) in all() { th { (title) } }
                },
                html! { @for case in &results.cases {
                    @for (k, p) in case.parameters.iter().enumerate() { tr {
                        td.name { @if k == 0 { (case.name) } }
                        td.name { (p.label) }
                        td data-is="truth" { @if let Some(truth) = p.truth { (plain(truth)) } }
                        @for (title, cases) in all() {
                            td data-is=(title) {
                                @let same = cases.iter().find(|other| other.name == case.name);
                                @if let Some(p) = same.and_then(|case| case.parameters.get(k)) {
                                    (within(p.q05)) " … " (within(p.q95))
                                }
                            }
                        }
                    } }
                } },
            )) }
            p.caption {
                "90 % intervals."
                @for variant in results.variants.iter().filter(|variant| !variant.missing.is_empty()) {
                    " Under " (variant.title) ", " (variant.missing.join(", ")) " could not be calibrated."
                }
            }
        }
    }
}
