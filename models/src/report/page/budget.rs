//! Section with the contributions to the variance of each parameter, one bar per parameter.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::Results;

/// Sources of uncertainty in the order of their colours; all other sources share one further colour.
const SOURCES: [&str; 4] = ["specimens", "geometry", "surrogate", "mesh"];

/// Shares of the sources in the variance of each parameter.
pub(super) struct Budget<'a> {
    /// Sources in the order of their columns.
    sources: Vec<&'a str>,
    /// Label of each parameter with its sources and their shares.
    parameters: &'a [(String, Vec<(String, f64)>)],
    /// Whether the runs come from outside this program.
    is_outside: bool,
}

pub(super) fn collect(results: &Results) -> Option<Budget<'_>> {
    let sources = sources(&results.budget);
    let is_outside = results.methods.as_ref().is_some_and(|methods| methods.outside.is_some());
    (!sources.is_empty()).then_some(Budget { sources, parameters: &results.budget, is_outside })
}

pub(super) fn show(Budget { sources, parameters, is_outside }: &Budget<'_>) -> Markup {
    let header = html! {
        th { "share of the variance" }
        @for source in sources {
            th { span class={ "key " (colour(source)) } {} (source) }
        }
    };
    let rows = html! {
        @for (parameter, shares) in *parameters {
            tr {
                td.name { (parameter) (bar(shares)) }
                @for source in sources {
                    td { @if let Some(share) = share(shares, source) { (percent(share)) } }
                }
            }
        }
    };
    let has_kind = |wanted: &str| sources.iter().any(|source| kind(source) == wanted);
    html! {
        section {
            h2 { "Where the uncertainty comes from" }
            (table(header, rows))
            p.caption {
                "Shares of the sources in the posterior variance, linearised at the posterior mean; the prior is not a source. \
                 Specimens: scatter between specimens, which more specimens reduce. Geometry: scatter \
                 between packings. Surrogate: error of the surrogate, which more runs reduce."
                @if has_kind("discrepancy") {
                    " Discrepancy: error of the model that the case states; it is not estimated from \
                     the data."
                }
                @if *is_outside {
                    " The intervals do not include an error of the simulator, unless it is stated in \
                     [calibration.discrepancy]."
                } @else if !has_kind("mesh") {
                    " The intervals do not include the error of the mesh, which the section on the confirming \
                     simulation estimates."
                }
            }
        }
    }
}

/// Sources that occur in the budget, in the order of [`SOURCES`]; other sources follow.
fn sources(budget: &[(String, Vec<(String, f64)>)]) -> Vec<&str> {
    let mut ordered: Vec<&str> = Vec::new();
    for (source, _) in budget.iter().flat_map(|(_, shares)| shares) {
        if !ordered.contains(&source.as_str()) {
            ordered.push(source);
        }
    }
    let rank =
        |source: &&str| SOURCES.iter().position(|s| *s == kind(source)).unwrap_or(SOURCES.len());
    ordered.sort_by_key(rank);
    ordered
}

fn share(shares: &[(String, f64)], source: &str) -> Option<f64> {
    shares.iter().find(|(name, _)| name == source).map(|(_, share)| *share)
}

/// Kind of a source: with several tests, the name of the source begins with the name of its test.
fn kind(source: &str) -> &str {
    source.rsplit(' ').next().unwrap_or(source)
}

/// Class of a source in the style sheet.
fn colour(source: &str) -> &str {
    let kind = kind(source);
    if SOURCES.contains(&kind) { kind } else { "other" }
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent > 0.0 && percent < 0.5 => "< 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

/// Bar that is divided into the shares of the sources.
fn bar(shares: &[(String, f64)]) -> Markup {
    let names: Vec<String> =
        shares.iter().map(|(source, share)| format!("{source} {}", percent(*share))).collect();
    let mut ordered: Vec<&(String, f64)> = shares.iter().collect();
    let rank = |part: &&(String, f64)| SOURCES.iter().position(|s| *s == kind(&part.0));
    ordered.sort_by_key(|part| rank(part).unwrap_or(SOURCES.len()));
    let ends = ordered.iter().scan(0.0, |end, part| {
        *end += 100.0 * part.1;
        Some(*end)
    });
    html! {
        svg.bar viewBox="0 0 100 10" preserveAspectRatio="none" role="img"
            aria-label=(names.join(", ")) {
            @for ((source, share), end) in ordered.iter().zip(ends) {
                @let (left, width) = (end - 100.0 * share, 100.0 * share);
                rect class=(colour(source)) x=(format!("{left:.2}")) width=(format!("{width:.2}"))
                    height="10" {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn results() -> Results {
        let shares = |shares: [f64; 3]| -> Vec<(String, f64)> {
            ["surrogate", "geometry", "specimens"]
                .map(str::to_owned)
                .into_iter()
                .zip(shares)
                .collect()
        };
        let budget = vec![
            ("E (MPa)".to_owned(), shares([0.056, 0.148, 0.796])),
            ("ξ (MPa s)".to_owned(), shares([0.001, 0.4, 0.599])),
        ];
        Results { budget, ..Results::default() }
    }

    #[test]
    fn shares_stand_in_one_order_and_fill_the_bar() {
        let results = results();
        let html = collect(&results).map(|budget| show(&budget).into_string()).unwrap_or_default();
        for cell in ["80 %", "15 %", "6 %", "60 %", "40 %", "&lt; 1 %"] {
            assert!(html.contains(&format!("<td>{cell}</td>")), "{cell}: {html}");
        }
        let bar = &html[html.find("<svg").unwrap()..html.find("</svg>").unwrap()];
        let rects: Vec<&str> = bar.split("<rect").skip(1).collect();
        assert!(rects[0].contains("class=\"specimens\" x=\"0.00\" width=\"79.60\""), "{bar}");
        assert!(rects[1].contains("class=\"geometry\" x=\"79.60\" width=\"14.80\""), "{bar}");
        assert!(rects[2].contains("class=\"surrogate\" x=\"94.40\" width=\"5.60\""), "{bar}");
    }

    #[test]
    fn sources_of_several_tests_have_the_colours_of_their_kinds() {
        let part = |source: &str| (source.to_owned(), 0.5);
        let shares = vec![part("slow mesh"), part("fast specimens")];
        let results =
            Results { budget: vec![("E (MPa)".to_owned(), shares)], ..Results::default() };
        let html = collect(&results).map(|budget| show(&budget).into_string()).unwrap_or_default();
        assert!(html.contains("<rect class=\"specimens\" x=\"0.00\""), "{html}");
        assert!(html.contains("key mesh") && !html.contains("do not include the error"), "{html}");
    }

    #[test]
    fn without_a_budget_there_is_no_section() {
        assert!(collect(&Results::default()).is_none());
    }
}
