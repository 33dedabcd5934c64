//! Section on the Markov chains.

use maud::{Markup, PreEscaped, html};

use super::parts::{caption, panels};
use crate::report::figures;
use crate::report::results::Results;

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (!results.parameters.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let chains = results.parameters.iter().map(|p| p.chains.len()).max().unwrap_or(0);
    let draws = results.parameters.iter().map(|p| p.draws().count()).max().unwrap_or(0);
    html! {
        section {
            h2 { "Sampling" }
            p {
                (draws) " draws in " (chains) " chains. "
                @match results.divergences {
                    0 => span.good { "No divergent transitions." },
                    n => span.bad { (n) " divergent transitions: the posterior has a part that the \
                                     sampler did not reach." },
                }
            }
            (panels(&figures::ranks(&results.parameters), html! {
                "Ranks of each chain's draws among the draws of all chains, one colour for each chain: uniform \
                 if the chains agree."
            }, "if a line rises or falls over the ranks, its chain has another distribution than the others: increase \
                calibration.warmup and calibration.draws."))
            figure {
                @for trace in figures::traces(&results.parameters) { (PreEscaped(trace)) }
                (caption(html! { "Draws in order, one colour for each chain." },
                    "a chain that drifts or stays at one value has not converged: increase calibration.warmup, or \
                     calibration.target_accept if there are divergent transitions."))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::CalibratedParameter;

    #[test]
    fn divergences_are_said_and_so_is_that_there_are_none() {
        let chains = vec![vec![1.0, 2.0, 4.0], vec![3.0, 1.5, 2.5]];
        let parameter = CalibratedParameter { chains, ..Default::default() };
        let mut results = Results { parameters: vec![parameter], ..Results::default() };
        let html = show(&results).into_string();
        assert!(html.contains("6 draws in 2 chains") && html.contains("No divergent transitions"));
        results.divergences = 3;
        assert!(show(&results).into_string().contains("3 divergent transitions"));
    }
}
