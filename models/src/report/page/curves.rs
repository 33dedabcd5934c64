//! Section on the measured curves and the range of the ensemble.

use maud::{Markup, html};

use super::parts::{figure, panels, table};
use crate::report::figures;
use crate::report::results::{Finding, Results};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    let has_quantities = results.qois.iter().any(|qoi| !qoi.ensemble.is_empty());
    let has_curves = !results.ensemble.is_empty() || !results.experiments.is_empty();
    (has_quantities || has_curves).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let has_curves = !results.ensemble.is_empty() || !results.experiments.is_empty();
    html! {
        section {
            h2 { "Curves and quantities of interest" }
            @if has_curves {
                (figure(&figures::curves(results), html! {
                    (results.ensemble.len()) " simulated tests over the prior box ("
                    (format!("{:.0}", results.ensemble_seconds)) " s of processor time), "
                    (results.experiments.len()) " measured curves. The range of the ensemble must include \
                    the experiments."
                }, "a measured curve beyond the range of the ensemble cannot be calibrated: check its units, its zero and \
                    its toe in the table below, then widen [prior]."))
            }
            @if !results.failures.is_empty() {
                p { "Runs that failed and are omitted:" }
                ul { @for (id, reason) in &results.failures { li { "run " (id) ": " (reason) } } }
            }
            (panels(&figures::of_the_ensemble(results), html! {
                "Bars: ensemble. Outline and dots: experiments; dashed: their mean."
            }, "if the dots are outside of the bars, no point of the prior explains the experiments: widen [prior], or \
                check for effects that [material] and [test] omit."))
            @if !results.experiments.is_empty() { (findings(results)) }
        }
    }
}

/// Table of the findings in the measured curves; findings of one kind share a row.
fn findings(results: &Results) -> Markup {
    let kinds = kinds(&results.findings);
    html! {
        h3 { "Checks of the curves" }
        @if kinds.is_empty() {
            p.good { "The checks of the measured curves found nothing." }
        } @else {
            (table(
                html! { th { "finding" } th.text { "specimens" } th.text {} },
                html! { @for kind in &kinds { tr {
                    td.name { (kind.finding) }
                    td.text { (kind.specimens.join("; ")) }
                    td.text { (kind.advice) }
                } } },
            ))
        }
    }
}

/// Findings of one kind, which share a row of the table.
struct Kind<'a> {
    finding: &'a str,
    /// Name of each specimen with its finding.
    specimens: Vec<String>,
    /// Advice that applies to all specimens of this kind.
    advice: &'a str,
}

/// Groups findings with the same name and the same advice (all sentences of the help text except the first), in order
/// of first occurrence.
fn kinds(findings: &[Finding]) -> Vec<Kind<'_>> {
    let mut kinds: Vec<Kind<'_>> = Vec::new();
    for Finding { specimen, finding, help } in findings {
        let (action, advice) = help.split_once(". ").unwrap_or((help, ""));
        let text = format!("{specimen} {}", action.trim_end_matches('.'));
        match kinds.iter_mut().find(|kind| kind.finding == finding && kind.advice == advice) {
            Some(kind) => kind.specimens.push(text),
            None => kinds.push(Kind { finding, specimens: vec![text], advice }),
        }
    }
    kinds
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(specimen: &str, finding: &str, help: &str) -> Finding {
        let [specimen, finding, help] = [specimen, finding, help].map(str::to_owned);
        Finding { specimen, finding, help }
    }

    #[test]
    fn what_is_alike_is_told_once() {
        let results = Results {
            findings: vec![
                finding("S-1", "toe", "begins to carry load at 0.01 mm. Correct it."),
                finding("S-2", "spike", "has a spike at 0.1 mm."),
                finding("S-3", "toe", "begins to carry load at 0.02 mm. Correct it."),
            ],
            ..Results::default()
        };
        let html = findings(&results).into_string();
        let toes = "S-1 begins to carry load at 0.01 mm; S-3 begins to carry load at 0.02 mm";
        assert!(html.contains(toes), "{html}");
        assert_eq!(html.matches("Correct it.").count(), 1);
        assert!(html.contains("S-2 has a spike at 0.1 mm<"), "{html}");
        assert!(findings(&Results::default()).into_string().contains("found nothing"));
    }
}
