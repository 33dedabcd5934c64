//! Table of the posterior correlations of the parameters.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::{CalibratedParameter, Results, mean};

/// Absolute correlation above which two parameters are hardly distinguishable.
const STRONG: f64 = 0.8;

/// Correlation matrix of the posterior draws.
pub(super) struct Correlations<'a> {
    labels: Vec<&'a str>,
    matrix: Vec<Vec<f64>>,
}

pub(super) fn collect(results: &Results) -> Option<Correlations<'_>> {
    let parameters = &results.parameters;
    let labels = parameters.iter().map(|p| p.label.as_str()).collect();
    let draws: Vec<Vec<f64>> = parameters.iter().map(standardised).collect();
    let row = |a: &Vec<f64>| draws.iter().map(|b| product(a, b)).collect();
    let matrix = draws.iter().map(row).collect();
    (parameters.len() > 1).then_some(Correlations { labels, matrix })
}

/// Draws of a parameter, centred and scaled to a sum of squares of one.
fn standardised(parameter: &CalibratedParameter) -> Vec<f64> {
    let draws: Vec<f64> = parameter.draws().collect();
    let mean = mean(&draws);
    let centred: Vec<f64> = draws.iter().map(|draw| draw - mean).collect();
    let length = product(&centred, &centred).sqrt();
    centred.iter().map(|draw| draw / length).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn show(Correlations { labels, matrix }: &Correlations<'_>) -> Markup {
    html! {
        section {
            h2 { "Correlations of the parameters" }
            (table(
                html! { th { "parameter" } @for label in labels { th { (label) } } },
                html! { @for (i, row) in matrix.iter().enumerate() { tr {
                    td.name { (labels[i]) }
                    @for (j, r) in row.iter().enumerate() {
                        td {
                            @if i == j { "1" }
                            @else if r.abs() > STRONG { strong { (format!("{r:+.2}")) } }
                            @else { (format!("{r:+.2}")) }
                        }
                    }
                } } },
            ))
            p.caption {
                "Pearson correlations of the posterior draws. Two parameters with a correlation beyond ± " (STRONG)
                " (bold) have similar effects on the curves: use their joint posterior, not their separate intervals."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_are_those_of_the_draws_over_all_chains() {
        let parameter = |label: &str, chains: [[f64; 2]; 2]| CalibratedParameter {
            label: label.into(),
            chains: chains.iter().map(|chain| chain.to_vec()).collect(),
            ..Default::default()
        };
        let parameters = vec![
            parameter("E", [[1.0, 2.0], [3.0, 4.0]]),
            parameter("Gc", [[8.0, 6.0], [4.0, 2.0]]),
            parameter("ξ", [[1.0, -1.0], [-1.0, 1.0]]),
        ];
        let results = Results { parameters, ..Results::default() };
        let correlations = collect(&results).expect("there are three parameters");
        assert!(
            (correlations.matrix[0][1] + 1.0).abs() < 1e-12
                && correlations.matrix[0][2].abs() < 1e-12
        );
        let html = show(&correlations).into_string();
        assert!(html.contains("<strong>-1.00</strong>") && html.contains("+0.00"), "{html}");
        assert!(collect(&Results::default()).is_none());
    }
}
