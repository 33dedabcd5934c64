//! Sections with the calibrated parameters, the warnings and the sources of uncertainty.

use super::parts::table;
use crate::report::digits::{plain, within};
use crate::report::results::{CalibratedParameter, Results};
use maud::{Markup, html};

pub(super) fn parameters(results: &Results) -> Markup {
    let with_truth = results.parameters.iter().any(|p| p.truth.is_some());
    let header = html! {
        th { "parameter" } th { "MAP" } th { "mean ± sd" } th { "90 % interval" }
        th { "prior" } th { "contraction" } th { "from the data" }
        @if with_truth { th { "truth" } }
    };
    let rows = html! {
        @for p in &results.parameters {
            tr {
                td.name { (p.label) }
                td data-is="MAP" { (within((p.map, p.mean.1))) }
                td data-is="mean ± sd" { (within(p.mean)) " ± " (within(p.sd)) }
                td data-is="90 % interval" { (within(p.q05)) " … " (within(p.q95)) }
                td data-is="prior" { (p.prior_words()) }
                td data-is="contraction" { (format!("{:.2}", p.contraction)) }
                td.wrapped data-is="from the data" { (verdict(p)) }
                @if with_truth {
                    td data-is="truth" { @if let Some(t) = p.truth { (plain(t)) } }
                }
            }
        }
    };
    html! {
        section {
            h2 { "Calibrated parameters" }
            div.cards { (table(header, rows)) }
            p.caption {
                "Digits that the Monte Carlo error allows. Contraction is 1 − posterior variance / \
                 prior variance: 0 if the data have no information on the parameter, 1 if they determine \
                 it. MAP is the joint mode over the constrained parameters; for a parameter that is not \
                 identified it is as good as any other point of its posterior."
            }
        }
    }
}

fn verdict(p: &CalibratedParameter) -> Markup {
    let verdict = p.verdict();
    let class = if verdict.is_good() { "verdict good" } else { "verdict weak" };
    html! { span class=(class) { (verdict) } }
}

pub(super) fn warnings(results: &Results) -> Markup {
    html! {
        section {
            h2 { "What to know before using them" }
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

/// Sources of uncertainty in the order of their colours; all other sources share one further colour.
const SOURCES: [&str; 4] = ["specimens", "geometry", "surrogate", "mesh"];

/// Section with the contributions to the variance of each parameter, one bar per parameter.
pub(super) fn budget(results: &Results) -> Markup {
    let sources = sources(&results.budget);
    if sources.is_empty() {
        return html! {};
    }
    let header = html! {
        th { "share of the variance" }
        @for source in &sources {
            th { span class={ "key " (colour(source)) } {} (source) }
        }
    };
    let rows = html! {
        @for (parameter, parts) in &results.budget {
            tr {
                td.name { (parameter) (bar(parts)) }
                @for source in &sources {
                    td { @if let Some(share) = share(parts, source) { (percent(share)) } }
                }
            }
        }
    };
    html! {
        section {
            h2 { "Where the uncertainty comes from" }
            (table(header, rows))
            p.caption {
                "Shares of the posterior variance without that of the prior, linearised at the posterior \
                 mean. Specimens: scatter between specimens, which more specimens reduce. Geometry: scatter \
                 between packings. Surrogate: its error, which more runs reduce."
                @if sources.contains(&"discrepancy") {
                    " Discrepancy: the error of the model that the case states; it does not come from \
                     the data."
                }
                @if !sources.contains(&"mesh") {
                    " The intervals do not include the error of the mesh; the section on the confirming \
                     simulation has its estimate."
                }
            }
        }
    }
}

/// Sources that occur in the budget, in the order of [`SOURCES`]; other sources follow.
fn sources(budget: &[(String, Vec<(String, f64)>)]) -> Vec<&str> {
    let mut found: Vec<&str> = Vec::new();
    for (source, _) in budget.iter().flat_map(|(_, parts)| parts) {
        if !found.contains(&source.as_str()) {
            found.push(source);
        }
    }
    let place = |source: &&str| SOURCES.iter().position(|s| s == source).unwrap_or(SOURCES.len());
    found.sort_by_key(place);
    found
}

fn share(parts: &[(String, f64)], source: &str) -> Option<f64> {
    parts.iter().find(|(name, _)| name == source).map(|(_, share)| *share)
}

/// Class of a source in the style sheet.
fn colour(source: &str) -> &str {
    if SOURCES.contains(&source) { source } else { "other" }
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent > 0.0 && percent < 0.5 => "< 1 %".to_owned(),
        percent => format!("{percent:.0} %"),
    }
}

/// Bar that is divided into the shares of the sources.
fn bar(parts: &[(String, f64)]) -> Markup {
    let names: Vec<String> =
        parts.iter().map(|(source, share)| format!("{source} {}", percent(*share))).collect();
    let mut ordered: Vec<&(String, f64)> = parts.iter().collect();
    let place = |part: &&(String, f64)| SOURCES.iter().position(|s| *s == part.0);
    ordered.sort_by_key(|part| place(part).unwrap_or(SOURCES.len()));
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
    use crate::prior::Prior;
    use crate::report::results::Qualifier;

    fn results() -> Results {
        let parts = |shares: [f64; 3]| -> Vec<(String, f64)> {
            ["surrogate", "geometry", "specimens"]
                .map(str::to_owned)
                .into_iter()
                .zip(shares)
                .collect()
        };
        let budget = vec![
            ("E (MPa)".to_owned(), parts([0.056, 0.148, 0.796])),
            ("ξ (MPa s)".to_owned(), parts([0.001, 0.4, 0.599])),
        ];
        Results { budget, ..Results::default() }
    }

    #[test]
    fn shares_stand_in_one_order_and_fill_the_bar() {
        let html = budget(&results()).into_string();
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
    fn a_qualified_verdict_is_not_green() {
        let draws: Vec<f64> = (0..100).map(|i| 40.0 + 0.2 * f64::from(i)).collect();
        let of = |qualifiers: &[Qualifier]| {
            let parameter = CalibratedParameter {
                prior: Prior::uniform(0.0, 100.0),
                map: 50.0,
                chains: vec![draws.clone()],
                contraction: 0.9,
                qualifiers: qualifiers.iter().copied().collect(),
                ..Default::default()
            };
            parameters(&Results { parameters: vec![parameter], ..Results::default() }).into_string()
        };
        assert!(of(&[]).contains("<span class=\"verdict good\">identified</span>"));
        let poor = of(&[Qualifier::PoorFit]);
        assert!(
            poor.contains("<span class=\"verdict weak\">identified, fit poor</span>"),
            "{poor}"
        );
    }

    #[test]
    fn a_page_without_warnings_says_so_and_one_with_warnings_does_not() {
        let quiet = warnings(&Results::default()).into_string();
        assert!(quiet.contains("No stage has warned."), "{quiet}");
        let warned = Results { warnings: vec!["The fit is poor".into()], ..Results::default() };
        let html = warnings(&warned).into_string();
        assert!(html.contains("<li>The fit is poor</li>") && !html.contains("No stage"), "{html}");
    }

    #[test]
    fn without_a_budget_there_is_no_section() {
        assert_eq!(budget(&Results::default()).into_string(), "");
    }

    #[test]
    fn parameters_have_the_digits_of_their_errors() {
        let parameter = CalibratedParameter {
            label: "E (MPa)".into(),
            prior: Prior::uniform(250.0, 300.0),
            mean: (283.4567, 0.08),
            sd: (4.5123, 0.06),
            q05: (276.312, 0.2),
            q95: (291.04, 0.15),
            map: 283.2911,
            ..Default::default()
        };
        let results = Results { parameters: vec![parameter], ..Results::default() };
        let html = parameters(&results).into_string();
        for cell in ["283.3", "283.5 ± 4.5", "276.3 … 291.0", "250 … 300"] {
            assert!(html.contains(&format!(">{cell}</td>")), "{cell}: {html}");
        }
    }
}
