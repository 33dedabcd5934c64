//! Section that compares predictions with held-out specimens.

use maud::{Markup, html};

use super::parts::{figure, panels, table};
use crate::report::digits::number;
use crate::report::figures;
use crate::report::results::{
    Results, ValidatedQuantity, ValidationCoverage, ValidationResult, ValidationVerdict,
};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.validations.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Validation with held-out specimens" }
            p {
                "Specimens that the calibration does not use, against their prediction: the posterior, the scatter between \
                 specimens and the error that all specimens share."
            }
            (coverage(&results.validation_coverage))
            @for result in &results.validations { (validation_section(result)) }
        }
    }
}

/// Sentences on the coverage over all quantities.
fn coverage(all: &[ValidationCoverage]) -> Markup {
    html! {
        @if !all.is_empty() {
            p {
                @for ValidationCoverage { level, counts: [inside, total], interval: [low, high] } in all {
                    (inside) " of " (total) " measurements are inside the " (percent(*level)) " interval: a coverage of "
                    (percent(*low)) " to " (percent(*high)) " (95 % interval of Clopper and Pearson). "
                }
                "This interval assumes independent measurements. Measurements of one specimen are correlated, and all \
                 specimens share the parameters: the verdicts below allow for the latter."
            }
        }
    }
}

fn percent(fraction: f64) -> String {
    format!("{:.0} %", 100.0 * fraction)
}

fn validation_section(result: &ValidationResult) -> Markup {
    let method = match result.method.as_str() {
        "surrogate" => format!("the surrogate at {} posterior draws", result.draws),
        _ => format!("simulations at {} posterior draws", result.draws),
    };
    html! {
        h3 { (result.name) }
        (table(
            html! {
                th { "quantity" } th { "measured mean" } th { "predicted mean" } th { "difference, sd" }
                th { "inside 50 %" } th { "inside 90 %" } th { "mean CRPS" } th.text { "verdict" }
            },
            html! { @for compared in &result.quantities { (row(compared)) } },
        ))
        (panels(&figures::validated(result), html! {
            "Points: held-out specimens. Bands: predicted 50 and 90 % intervals of a new specimen; line: predicted median. \
             Predicted by " (method) "."
        }, "points beyond the dark band on one side contradict the model in this test; points far beyond it on both sides show \
            that the specimens scatter more than those of the calibration."))
        @if let Some(svg) = figures::validated_curves(result) {
            (figure(&svg, html! {
                "Curves of held-out specimens (dashed) and the band of predicted curves of new specimens."
            }, "a curve that leaves the band in its rise has another stiffness or a toe; after the peak, the damage model \
                differs from the specimens."))
        }
    }
}

fn row(validated: &ValidatedQuantity) -> Markup {
    let total = validated.specimens.len();
    let inside = |k: usize| {
        validated.inside.map_or_else(String::new, |all| format!("{} of {total}", all[k]))
    };
    html! { tr {
        td.name { (validated.label) }
        td { (number(validated.means[0])) }
        td { (number(validated.means[1])) }
        td { @if let Some(deviation) = validated.deviation { (format!("{deviation:+.1}")) } }
        td { (inside(0)) }
        td { (inside(1)) }
        td { @if let Some(crps) = validated.crps { (number(crps)) } }
        td.text { (words(validated.verdict)) }
    } }
}

fn words(verdict: ValidationVerdict) -> &'static str {
    match verdict {
        ValidationVerdict::Contradicted => "contradicts the prediction",
        ValidationVerdict::TooWide => "the prediction is too wide",
        ValidationVerdict::Consistent => "consistent with the prediction",
        ValidationVerdict::NotJudged => "not judged: the scatter between specimens is unknown",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_coverage_and_verdicts_are_shown() {
        let judged = ValidatedQuantity {
            label: "peak force (N)".into(),
            quantiles: [90.0, 97.0, 100.0, 103.0, 110.0].map(Some),
            specimens: vec![("H-1".into(), 120.0), ("H-2".into(), 104.0)],
            inside: Some([0, 1]),
            crps: Some(6.25),
            means: [112.0, 100.0],
            deviation: Some(3.21),
            verdict: ValidationVerdict::Contradicted,
        };
        let unknown = ValidatedQuantity {
            quantiles: [None, None, Some(100.0), None, None],
            inside: None,
            crps: None,
            deviation: None,
            verdict: ValidationVerdict::NotJudged,
            ..judged.clone()
        };
        let validation = ValidationResult {
            name: "slow".into(),
            method: "simulations".into(),
            draws: 24,
            quantities: vec![judged, unknown],
            ..Default::default()
        };
        let coverage = ValidationCoverage { level: 0.9, counts: [1, 2], interval: [0.01, 0.99] };
        let results = Results {
            validations: vec![validation],
            validation_coverage: vec![coverage],
            ..Results::default()
        };
        let page = show(collect(&results).unwrap()).into_string();
        for part in [
            "<h3>slow</h3>",
            "1 of 2 measurements are inside the 90 % interval",
            "1 % to 99 %",
            "<td>+3.2</td>",
            "<td>1 of 2</td>",
            "contradicts the prediction",
            "not judged",
            "simulations at 24 posterior draws",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert!(collect(&Results::default()).is_none());
    }
}
