//! Figures of quantities of interest: of the ensemble, of new specimens, of the experiments.

use kuva::prelude::*;

use super::draw::{count, lerp, line, round_range};
use crate::report::results::{Qoi, Results, mean};
use crate::report::style::{DRAWS_FILL, ENSEMBLE, MEASURED, POSTERIOR, framed, panel, single};

/// Number of bins of a histogram of simulations.
const BINS: usize = 16;
/// Width and height of a panel in units of the drawing.
const SIZE: (f64, f64) = (330.0, 290.0);

/// Normalised histograms of the quantities of the ensemble and of the experiments.
pub(in crate::report) fn of_the_ensemble(results: &Results) -> Vec<String> {
    let one = |qoi: &Qoi| {
        let range = round_range(qoi.ensemble.iter().chain(&qoi.experiments).copied());
        beside(qoi, range, vec![(edges(range, BINS), &qoi.ensemble, ENSEMBLE)], None)
    };
    results
        .qois
        .iter()
        .filter(|q| !q.ensemble.is_empty() || !q.experiments.is_empty())
        .map(one)
        .collect()
}

/// Posterior predictive histograms of new specimens, with the experiments.
pub(in crate::report) fn predictive(results: &Results) -> Vec<String> {
    let one = |qoi: &Qoi| {
        // the range omits 0.5 % of the draws at each end, because the tails would compress the figure
        let mut sorted = qoi.predictive.clone();
        sorted.sort_by(f64::total_cmp);
        let most = sorted.len().saturating_sub(1);
        let ends = [most / 200, most - most / 200];
        let middle = ends.into_iter().filter_map(|i| sorted.get(i).copied());
        let range = round_range(middle.chain(qoi.experiments.iter().copied()));
        let inside: Vec<f64> =
            sorted.iter().copied().filter(|x| (range.0..=range.1).contains(x)).collect();
        beside(qoi, range, vec![(edges(range, 2 * BINS), &inside, DRAWS_FILL)], None)
    };
    results.qois.iter().filter(|qoi| !qoi.predictive.is_empty()).map(one).collect()
}

/// Quantities of the experiments, their mean, and the simulation at the MAP.
pub(in crate::report) fn map_beside_experiments(results: &Results) -> Vec<String> {
    let one = |qoi: &Qoi| {
        let range = round_range(qoi.experiments.iter().chain([&qoi.map]).copied());
        beside(qoi, range, Vec::new(), Some(qoi.map))
    };
    results.qois.iter().map(one).collect()
}

/// One panel: normalised `histograms`, and in front of these histograms the histogram of the experiments as an
/// outline, the mean of the experiments as a dashed line, and the MAP as a solid line.
fn beside<'a>(
    qoi: &'a Qoi,
    range: (f64, f64),
    histograms: Vec<(Vec<f64>, &'a Vec<f64>, &str)>,
    map: Option<f64>,
) -> String {
    let mut top: f64 = 0.0;
    let mut plots: Vec<Plot> = Vec::new();
    for (edges, values, colour) in histograms {
        let heights = densities(&edges, values);
        top = heights.iter().copied().fold(top, f64::max);
        plots.push(Histogram::new().with_precomputed(edges, heights).with_color(colour).into());
    }
    if !qoi.experiments.is_empty() {
        let experiments_range = round_range(qoi.experiments.iter().copied());
        let experiments_range =
            (experiments_range.0.max(range.0), experiments_range.1.min(range.1));
        let edges = edges(experiments_range, few(qoi.experiments.len()));
        let heights = densities(&edges, &qoi.experiments);
        top = heights.iter().copied().fold(top, f64::max);
        // only the outline, so that histograms behind it are visible
        plots.push(line(outline(&edges, &heights), MEASURED, 1.6).into());
    }
    let top = if top > 0.0 { 1.15 * top } else { 1.0 };
    if !qoi.experiments.is_empty() {
        let ticks = qoi.experiments.iter().map(|&x| (x, 0.03 * top));
        plots.push(ScatterPlot::new().with_data(ticks).with_color(MEASURED).with_size(4.0).into());
        let mean = mean(&qoi.experiments);
        plots.push(line([(mean, 0.0), (mean, top)], MEASURED, 1.4).with_dashed().into());
    }
    if let Some(map) = map {
        plots.push(line([(map, 0.0), (map, top)], POSTERIOR, 2.2).into());
    }
    let layout = framed(panel(&plots, &qoi.label, "density"), range, (0.0, top)).with_ticks(4);
    single(plots, layout, SIZE.0, SIZE.1)
}

/// Number of bins by Sturges' rule, for the histogram of few specimens.
fn few(specimens: usize) -> usize {
    (specimens.max(1) as f64).log2().ceil() as usize + 1
}

fn edges(range: (f64, f64), bins: usize) -> Vec<f64> {
    (0..=bins).map(|i| lerp(range, i as f64 / bins as f64)).collect()
}

/// Counts divided by the number of values and the bin width; zeros if there are no values.
fn densities(edges: &[f64], values: &[f64]) -> Vec<f64> {
    let scale = 1.0 / (values.len().max(1) as f64 * (edges[1] - edges[0]));
    count(edges, values).into_iter().map(|count| count * scale).collect()
}

/// The outline of a histogram as one line.
fn outline(edges: &[f64], heights: &[f64]) -> Vec<(f64, f64)> {
    let mut outline = vec![(edges[0], 0.0)];
    for (i, &height) in heights.iter().enumerate() {
        outline.extend([(edges[i], height), (edges[i + 1], height)]);
    }
    outline.extend(edges.last().map(|&end| (end, 0.0)));
    outline
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_and_their_outline_enclose_one() {
        let edges = edges((2.0, 4.0), 4);
        let heights = densities(&edges, &[2.1, 2.2, 3.9, 2.6]);
        assert_eq!(heights, [1.0, 0.5, 0.0, 0.5]);
        let area: f64 = outline(&edges, &heights)
            .windows(2)
            .map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0))
            .sum();
        assert!((area - 1.0).abs() < 1e-12, "{area}");
        assert_eq!(densities(&edges, &[]), [0.0; 4]);
    }

    #[test]
    fn every_quantity_has_a_panel_and_predictions_only_where_there_are_some() {
        let qoi = Qoi {
            label: "peak force (N)".into(),
            experiments: vec![140.0, 147.0, 151.0],
            ensemble: vec![90.0, 120.0, 180.0],
            map: 146.0,
            ..Qoi::default()
        };
        let predicted = Qoi { predictive: vec![139.0, 144.0, 149.0, 152.0], ..qoi.clone() };
        let results = Results { qois: vec![qoi, predicted], ..Results::default() };
        assert_eq!(of_the_ensemble(&results).len(), 2);
        let half = Qoi { experiments: Vec::new(), ..results.qois[0].clone() };
        let qois = vec![half, Qoi::default()];
        let panels = of_the_ensemble(&Results { qois, ..Results::default() });
        assert!(panels.len() == 1 && !panels[0].contains("NaN"), "{panels:?}");
        assert_eq!(map_beside_experiments(&results).len(), 2);
        let predictive = predictive(&results);
        assert_eq!(predictive.len(), 1);
        assert!(predictive[0].contains("peak force (N)"));
    }
}
