//! Section with the influence of the priors on the parameters, and with the evidence.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::{ParameterSensitivity, Results};

/// Sensitivities of the parameters, and the logarithm of the evidence with its error.
pub(super) struct Influence<'a> {
    parameters: &'a [ParameterSensitivity],
    evidence: Option<[f64; 2]>,
}

pub(super) fn collect(results: &Results) -> Option<Influence<'_>> {
    let (parameters, evidence) = (&results.sensitivities, results.evidence);
    (!parameters.is_empty() || evidence.is_some()).then_some(Influence { parameters, evidence })
}

pub(super) fn show(Influence { parameters, evidence }: &Influence<'_>) -> Markup {
    html! {
        section {
            h2 { "How much do the priors contribute?" }
            @if !parameters.is_empty() {
                (table(
                    html! {
                        th { "sensitivity" } th { "to the priors" } th { "to the priors of the scatter" }
                        th { "to the data" } th.text { "diagnosis" }
                    },
                    html! { @for one in *parameters { tr {
                        td.name { (one.label) }
                        @for value in one.sensitivities { td { (format!("{value:.2}")) } }
                        td.name { (one.diagnosis) }
                    } } },
                ))
                p.caption {
                    "Change of the posterior of a parameter if the priors of the parameters, the priors of the scatter between \
                     specimens, or the likelihood are raised to a power, per doubling of the power (Kallioinen et al. 2024, \
                     doi:10.1007/s11222-023-10366-5). Values below 0.05 are negligible. A uniform prior does not change by a power; its bounds \
                     do not count."
                }
            }
            @if let Some([ln, error]) = evidence {
                p { "Evidence: ln p(data) = " (format!("{ln:.2} ± {error:.2}")) ". The data are the quantities of the \
                     specimens, relative to their means. Models of the same specimens and quantities can be compared: a difference of \
                     3 is a factor of 20 in favour of the larger one. The evidence depends on the priors, also on the bounds of \
                     uniform ones." }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensitivities_and_evidence_are_shown_if_they_are_there() {
        assert!(collect(&Results::default()).is_none());
        let one = ParameterSensitivity {
            label: "E (MPa)".into(),
            sensitivities: [0.123, 0.0, 0.301],
            diagnosis: "prior and data disagree".into(),
        };
        let results = Results {
            sensitivities: vec![one],
            evidence: Some([-12.345, 0.021]),
            ..Results::default()
        };
        let html = show(&collect(&results).unwrap()).into_string();
        for part in ["<td>0.12</td><td>0.00</td><td>0.30</td>", "disagree", "−12.35 ± 0.02"] {
            let part = part.replace('−', "-");
            assert!(html.contains(&part), "{part}: {html}");
        }
        let without = Results { evidence: None, ..results };
        assert!(!show(&collect(&without).unwrap()).into_string().contains("Evidence"));
    }
}
