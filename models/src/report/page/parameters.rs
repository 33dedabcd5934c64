//! Section with the calibrated parameters.

use maud::{Markup, html};

use super::parts::table;
use crate::report::digits::{plain, within};
use crate::report::results::{
    CalibratedParameter, IDENTIFIED, MARGIN, MOST_AT_BOUND, Results, WEAKLY,
};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.parameters.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
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
                "Numbers have the digits that the Monte Carlo error allows. Contraction is 1 − posterior variance / \
                 prior variance: 0 if the data have no information on the parameter, 1 if they determine \
                 it. A parameter is identified if its contraction is at least " (IDENTIFIED) ", weakly identified if it is at least "
                (WEAKLY) ", and otherwise not identified. A parameter is at the bound of its prior if the MAP or more than "
                (percent(MOST_AT_BOUND)) " of the draws are within " (percent(MARGIN)) " of the prior's width \
                 from a bound. MAP is the joint mode over the constrained parameters; for a parameter that is not \
                 identified, the MAP is not better than other points of the posterior."
            }
        }
    }
}

fn percent(fraction: f64) -> String {
    format!("{:.0} %", 100.0 * fraction)
}

fn verdict(p: &CalibratedParameter) -> Markup {
    let verdict = p.verdict();
    let class = if verdict.is_good() { "verdict good" } else { "verdict weak" };
    html! { span class=(class) { (verdict) } }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;
    use crate::report::results::Qualifier;

    #[test]
    fn a_qualified_verdict_is_not_green() {
        let draws: Vec<f64> = (0..100).map(|i| 40.0 + 0.2 * f64::from(i)).collect();
        let shown = |qualifiers: &[Qualifier]| {
            let parameter = CalibratedParameter {
                prior: Prior::uniform(0.0, 100.0),
                map: 50.0,
                chains: vec![draws.clone()],
                contraction: 0.9,
                qualifiers: qualifiers.iter().copied().collect(),
                ..Default::default()
            };
            show(&Results { parameters: vec![parameter], ..Results::default() }).into_string()
        };
        assert!(shown(&[]).contains("<span class=\"verdict good\">identified</span>"));
        let poor = shown(&[Qualifier::PoorFit]);
        assert!(
            poor.contains("<span class=\"verdict weak\">identified, fit poor</span>"),
            "{poor}"
        );
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
        let html = show(&results).into_string();
        for cell in ["283.3", "283.5 ± 4.5", "276.3 … 291.0", "250 … 300"] {
            assert!(html.contains(&format!(">{cell}</td>")), "{cell}: {html}");
        }
    }

    #[test]
    fn the_thresholds_of_the_verdicts_are_stated() {
        let parameter =
            CalibratedParameter { prior: Prior::uniform(0.0, 1.0), ..Default::default() };
        let html =
            show(&Results { parameters: vec![parameter], ..Results::default() }).into_string();
        for part in [
            "if its contraction is at least 0.5,",
            "weakly identified if it is at least 0.1,",
            "more than 5 %",
            "within 1 %",
        ] {
            assert!(html.contains(part), "{part}: {html}");
        }
    }
}
