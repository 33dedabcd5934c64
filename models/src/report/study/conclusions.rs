//! Sections that compare the conclusions of a study under several settings.

use maud::{Markup, html};

use super::super::digits::{plain, within};
use super::super::page::parts::table;
use super::results::{Conclusion, StudyResults};

/// Section with the conclusions of the study, and whether each is confirmed under the other settings.
pub(super) fn conclusions(results: &StudyResults) -> Markup {
    if results.variants.is_empty() {
        return html! {};
    }
    let count = results.conclusions.len();
    let mut missing: Vec<&str> = results
        .variants
        .iter()
        .flat_map(|variant| &variant.missing)
        .chain(&results.missing)
        .map(String::as_str)
        .collect();
    missing.sort_unstable();
    missing.dedup();
    let survive = |k: usize| results.conclusions.iter().filter(|c| holds(c, k)).count();
    html! {
        section {
            h2 { "Which conclusions survive?" }
            @for (k, variant) in results.variants.iter().enumerate() {
                p { "Under " (variant.title) " " (survive(k)) " of " (count) " conclusions survive." }
            }
            div.cards.tight { (table(
                html! {
                    th { "conclusion" } th.text { (results.title) }
                    @for variant in &results.variants { th.text { (variant.title) } }
                },
                html! { @for conclusion in &results.conclusions { tr {
                    td.name.wrapped.claim { (conclusion.claim) }
                    td.text data-is=(results.title) {
                        span { @if let Some((evidence, _)) = conclusion.evidence.first() { (evidence) } }
                    }
                    @for (k, variant) in results.variants.iter().enumerate() {
                        td.text data-is=(variant.title) { span {
                            @let survives = holds(conclusion, k);
                            span class=(if survives { "verdict good" } else { "verdict weak" }) {
                                @if survives { "survives" } @else { "does not survive" }
                            }
                            " " @if let Some((evidence, _)) = conclusion.evidence.get(k + 1) { (evidence) }
                        } }
                    }
                } } },
            )) }
            p.caption {
                "Each conclusion is a result of the first setting; the conclusion survives if the other setting has \
                 the same result. Cases of one laboratory agree on a parameter if, for every two cases, the 90 % \
                 interval of the ratio includes 1. Intervals include the truth as often as stated if the observed \
                 or a lower count has a probability of at least 5 %."
                @if !missing.is_empty() {
                    " " (missing.join(", ")) " could not be calibrated under all settings, and is omitted."
                }
            }
        }
    }
}

/// Whether the variant with this number confirms a conclusion.
fn holds(conclusion: &Conclusion, variant: usize) -> bool {
    conclusion.evidence.get(variant + 1).is_some_and(|(_, holds)| *holds)
}

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
            p.caption { "90 % intervals." }
        }
    }
}
