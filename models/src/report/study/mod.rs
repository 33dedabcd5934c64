//! Report of a study: the results of several calibrations on one page.

mod models;
mod results;
mod settings;

use maud::{Markup, PreEscaped, html};

use super::digits::{number, plain, within};
use super::document::document;
use super::figures::{colour_of, overlaid};
use super::page::parts::table;
use super::results::CalibratedParameter;
use models::models;
use results::REPRODUCED;
pub(crate) use results::{ComparedCase, Pair, StudyResults, Variant};
use settings::settings;

/// The page as HTML, with inline figures.
pub(crate) fn study_page(results: &StudyResults) -> String {
    let content = html! {
        @for text in &results.contradictions { p.bad { (text) } }
        p { "Each case has a report of its own: "
            @for (k, case) in results.cases.iter().enumerate() {
                @if k > 0 { ", " }
                a href={ (case.name) "/report.html" } { (case.name) }
            }
            "."
        }
        @if !results.missing.is_empty() {
            p.bad { "Cases that could not be calibrated: " (results.missing.join(", ")) "." }
        }
        @if !results.variants.is_empty() {
            p { "Under other settings: "
                @for (k, variant) in results.variants.iter().enumerate() {
                    @if k > 0 { ", " }
                    a href={ (variant.folder) "/report.html" } { (variant.title) }
                }
                "."
            }
        }
        (parameters(&results.cases))
        (settings(results))
        (overlays(&results.cases))
        (agreement(&results.pairs))
        (models(&results.cases))
        (confirmation(&results.cases))
        (cautions(&results.cases))
        section {
            h2 { "How it was made" }
            details { summary { "The file of the study" } pre { (results.text) } }
        }
    };
    document(&results.title, "study", &content)
}

/// Section with a table of the calibrated parameters: estimates, whether the data identify them, and the known truth if
/// there is one.
fn parameters(cases: &[ComparedCase]) -> Markup {
    let all = || cases.iter().flat_map(|case| &case.parameters);
    let with_truth = all().any(|p| p.truth.is_some());
    let published = cases.iter().flat_map(|case| &case.reference).any(Option::is_some);
    let inside = |p: &CalibratedParameter| p.truth.map(|t| (p.q05.0..=p.q95.0).contains(&t));
    let identified = all().filter(|p| p.verdict().is_identified());
    let inside_truths: Vec<bool> = identified.filter_map(inside).collect();
    html! {
        section {
            h2 { "Which parameters are identified?" }
            div.cards.tight { (table(
                html! {
                    th { "case" } th.text { "parameter" } th { "MAP" }
                    @if published { th { "published" } }
                    th { "mean ± sd" } th { "90 % interval" }
                    @if with_truth { th { "truth" } }
                    th { "prior" } th { "from the data" }
                },
                html! { @for case in cases {
                    @for (k, p) in case.parameters.iter().enumerate() { tr {
                        td.name { @if k == 0 { (case.name) } }
                        td.name { (p.label) }
                        td data-is="MAP" { (within((p.map, p.mean.1))) }
                        @if published {
                            td data-is="published" {
                                @if let Some(Some(map)) = case.reference.get(k) { (number(*map)) }
                            }
                        }
                        td data-is="mean ± sd" { (within(p.mean)) " ± " (within(p.sd)) }
                        td data-is="90 % interval" { (within(p.q05)) " … " (within(p.q95)) }
                        @if with_truth {
                            td data-is="truth" { @if let Some(truth) = p.truth {
                                (plain(truth))
                                @if inside(p) == Some(false) { ", outside" }
                            } }
                        }
                        td data-is="prior" { (p.prior_words()) }
                        td.wrapped data-is="from the data" {
                            @let verdict = p.verdict();
                            span class=(if verdict.is_good() { "verdict good" } else { "verdict weak" }) {
                                (verdict)
                            }
                        }
                    } }
                } },
            )) }
            @if !inside_truths.is_empty() {
                p { "Of " (inside_truths.len()) " identified parameters with a known truth "
                    (inside_truths.iter().filter(|inside| **inside).count()) " have 90 % intervals that include the truth." }
            }
        }
    }
}

/// Section with the posteriors of all cases, one figure for each parameter.
fn overlays(cases: &[ComparedCase]) -> Markup {
    let mut labels: Vec<&str> = Vec::new();
    for p in cases.iter().flat_map(|case| &case.parameters) {
        if !labels.contains(&p.label.as_str()) {
            labels.push(&p.label);
        }
    }
    let figure = |label: &&str| {
        let curves = cases.iter().enumerate().filter_map(|(k, case)| {
            Some((k, case.parameters.iter().find(|p| p.label == **label)?))
        });
        overlaid(label, &curves.collect::<Vec<_>>())
    };
    html! {
        section {
            h2 { "Posteriors of all cases" }
            figure {
                p.legend { @for (k, case) in cases.iter().enumerate() { span {
                    svg width="22" height="4" aria-hidden="true" {
                        rect width="22" height="4" fill=(colour_of(k)) {}
                    }
                    (case.name)
                } } }
                div.panels.large { @for label in &labels { (PreEscaped(figure(label))) } }
                figcaption { "Densities of the draws. Dashed: priors. Vertical dotted lines: true values." }
            }
        }
    }
}

/// Section that compares the posteriors of pairs of cases: overlap and ratio.
fn agreement(pairs: &[Pair]) -> Markup {
    if pairs.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "Do the cases agree?" }
            (table(
                html! {
                    th { "case" } th.text { "beside" } th.text { "parameter" } th { "overlap" }
                    th { "ratio, median" } th { "90 % interval" } th { "differ" }
                },
                html! { @for pair in pairs { tr {
                    td.name { (pair.cases[0]) } td.name { (pair.cases[1]) } td.name { (pair.label) }
                    td { (format!("{:.0} %", 100.0 * pair.overlap)) }
                    td { (format!("{:.3}", pair.ratio[0])) }
                    td { (format!("{:.3} … {:.3}", pair.ratio[1], pair.ratio[2])) }
                    td { @if pair.differ() { "yes" } @else { "no" } }
                } } },
            ))
            p.caption {
                "Overlap: probability mass that the two posteriors have in common. Ratio: second case divided by the \
                 first case; the cases differ if the 90 % interval of the ratio excludes 1. Posteriors from the \
                 same specimens are compared as if they were independent."
            }
        }
    }
}

/// Section that compares simulations at the posterior mode with the mean quantities of the experiments.
fn confirmation(cases: &[ComparedCase]) -> Markup {
    let all = || cases.iter().flat_map(|case| &case.qois);
    let (count, good) = (all().count(), all().filter(|q| q.percent_error <= REPRODUCED).count());
    let published = cases.iter().any(|case| !case.reference_errors.is_empty());
    html! {
        section {
            h2 { "Do simulations at the MAP reproduce the experiments?" }
            p { (good) " of " (count) " quantities are within " (REPRODUCED) " % of the experimental mean." }
            (table(
                html! {
                    th { "case" } th.text { "quantity" } th { "experimental mean" } th { "at the MAP" }
                    th { "difference" } @if published { th { "published" } } th { "error of the mesh" }
                },
                html! { @for case in cases {
                    @for (k, qoi) in case.qois.iter().enumerate() { tr {
                        td.name { @if k == 0 { (case.name) } }
                        td.name { (qoi.label) }
                        td { (number(super::results::mean(&qoi.experiments))) }
                        td { (number(qoi.map)) }
                        td { (format!("{:.2} %", qoi.percent_error)) }
                        @if published {
                            td { @if let Some(e) = case.reference_errors.get(k) { (format!("{e:.2} %")) } }
                        }
                        td { @if let Some(e) = qoi.mesh_error_percent { (format!("{e:+.1} %")) } }
                    } }
                } },
            ))
        }
    }
}

fn cautions(cases: &[ComparedCase]) -> Markup {
    html! {
        section {
            h2 { "Warnings" }
            @for case in cases.iter().filter(|case| !case.warnings.is_empty()) {
                h3 { (case.name) }
                ul.warnings { @for text in &case.warnings { li { (text) } } }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::results::Qoi;
    use super::*;
    use crate::prior::Prior;

    fn case(name: &str, map: f64, error: f64) -> ComparedCase {
        let draws: Vec<f64> = (0..200).map(|i| map - 5.0 + 0.05 * f64::from(i)).collect();
        ComparedCase {
            name: name.into(),
            names: vec!["matrix.young_mpa".into()],
            parameters: vec![CalibratedParameter {
                label: "E (MPa)".into(),
                prior: Prior::uniform(250.0, 350.0),
                mean: (map, 0.05),
                sd: (2.9, 0.05),
                q05: (map - 4.5, 0.1),
                q95: (map + 4.5, 0.1),
                map,
                chains: vec![draws],
                contraction: 0.99,
                truth: Some(285.0),
                ..Default::default()
            }],
            reference: vec![Some(286.181)],
            qois: vec![Qoi { label: "slope".into(), percent_error: error, ..Default::default() }],
            reference_errors: vec![1.225],
            ..Default::default()
        }
    }

    #[test]
    fn the_page_answers_with_numbers() {
        let pair = Pair {
            cases: ["A".into(), "B".into()],
            label: "E (MPa)".into(),
            overlap: 0.25,
            ratio: [1.05, 1.02, 1.08],
        };
        let cases = vec![case("A", 284.0, 2.0), case("B", 300.0, 12.0)];
        let results = StudyResults {
            title: "T".into(),
            contradictions: vec!["The intervals are too narrow.".into()],
            cases: cases.clone(),
            pairs: vec![pair],
            text: "x".into(),
            variants: vec![Variant {
                title: "V".into(),
                folder: "v".into(),
                cases,
                missing: vec!["C".into()],
            }],
            missing: vec!["D".into()],
        };
        let page = study_page(&results);
        let first = page.find("<p").map(|at| &page[at..at + 60]);
        assert!(first.is_some_and(|p| p.contains("The intervals are too narrow.")), "{first:?}");
        for part in [
            "Of 2 identified parameters with a known truth 1 have 90 % intervals that include the truth.",
            "1 of 2 quantities are within 10 %",
            "href=\"B/report.html\"",
            "<td data-is=\"published\">286.2</td>",
            "<td data-is=\"truth\">285, outside</td>",
            "href=\"v/report.html\"",
            "<td data-is=\"V\">279.5 … 288.5</td>",
            "Cases that could not be calibrated: D.",
            "Under V, C could not be calibrated.",
            "<td>25 %</td><td>1.050</td><td>1.020 … 1.080</td><td>yes</td>",
            "<svg viewBox=",
            "<p class=\"legend\"><span><svg",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert_eq!(page, study_page(&results), "the same again");
    }
}
