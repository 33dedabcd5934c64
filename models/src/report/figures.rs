//! The figures of the report, each from plain numbers to SVG.

use kuva::prelude::*;

use super::results::{CalibratedParameter, OrderErrors, Results, mean};
use super::style::{
    ENSEMBLE, MEASURED, POSTERIOR, PRIOR, SERIES, TRUTH, framed, grid, panel, single,
};

fn line(points: impl IntoIterator<Item = (f64, f64)>, color: &str, width: f64) -> LinePlot {
    LinePlot::new().with_data(points).with_color(color).with_stroke_width(width)
}

/// Experimental curves over the ensemble that has to bound them.
pub(super) fn curves(results: &Results) -> String {
    let mut plots: Vec<Plot> = Vec::new();
    for (i, curve) in results.ensemble.iter().enumerate() {
        let plot = line(curve.iter().copied(), ENSEMBLE, 0.7);
        plots.push(if i == 0 { plot.with_legend("ensemble").into() } else { plot.into() });
    }
    for (i, (_, curve)) in results.experiments.iter().enumerate() {
        let plot = line(thin(curve, 240), MEASURED, 1.4).with_dashed();
        plots.push(if i == 0 { plot.with_legend("experiments").into() } else { plot.into() });
    }
    force_displacement(plots)
}

/// Experiments with the simulations at the MAP and at posterior draws.
pub(super) fn confirmation(results: &Results) -> String {
    let mut plots: Vec<Plot> = Vec::new();
    for (i, (_, curve)) in results.experiments.iter().enumerate() {
        let plot = line(thin(curve, 240), MEASURED, 1.2).with_dashed();
        plots.push(if i == 0 { plot.with_legend("experiments").into() } else { plot.into() });
    }
    for (i, curve) in results.posterior_curves.iter().enumerate() {
        let plot = line(curve.iter().copied(), "#e3a8a6", 1.2);
        plots.push(if i == 0 { plot.with_legend("posterior draws").into() } else { plot.into() });
    }
    plots.push(line(results.map_curve.iter().copied(), POSTERIOR, 2.6).with_legend("MAP").into());
    force_displacement(plots)
}

/// Curves from the origin: readings below it are noise.
fn force_displacement(plots: Vec<Plot>) -> String {
    let layout = panel(&plots, "displacement (mm)", "force (N)")
        .with_x_axis_min(0.0)
        .with_y_axis_min(0.0)
        .with_legend_position(LegendPosition::InsideBottomRight);
    single(plots, layout, 760.0, 430.0)
}

/// Histograms of the ensemble's QoIs with the experiments, their mean and the MAP on top.
pub(super) fn qois(results: &Results) -> String {
    let panels = results
        .qois
        .iter()
        .map(|qoi| {
            let all = qoi.ensemble.iter().chain(&qoi.experiments).chain([&qoi.map]);
            let range = round_range(all.copied());
            let edges: Vec<f64> = (0..=16).map(|i| lerp(range, f64::from(i) / 16.0)).collect();
            let mut plots: Vec<Plot> = vec![bars(&edges, &qoi.ensemble, ENSEMBLE)];
            let top = tallest(&edges, &qoi.ensemble).max(1.0) * 1.15;
            let ticks = qoi.experiments.iter().map(|&x| (x, 0.03 * top));
            plots.push(
                ScatterPlot::new().with_data(ticks).with_color(MEASURED).with_size(4.0).into(),
            );
            let mean = mean(&qoi.experiments);
            plots.push(line([(mean, 0.0), (mean, top)], MEASURED, 1.6).with_dashed().into());
            plots.push(line([(qoi.map, 0.0), (qoi.map, top)], POSTERIOR, 2.2).into());
            let layout = framed(panel(&plots, &qoi.label, "runs"), range, (0.0, top));
            (plots, layout)
        })
        .collect();
    grid(1, results.qois.len(), panels, (330.0, 290.0))
}

/// One of the errors of an order.
type ErrorOf = fn(&OrderErrors) -> Option<f64>;

/// Errors of the expansion by order, on a logarithmic scale.
pub(super) fn orders(results: &Results) -> String {
    let series: [(&str, ErrorOf); 4] = [
        ("corrected LOO", |o| o.corrected),
        ("LOO", |o| o.loo),
        ("validation (30 %)", |o| o.validation),
        ("training (70 %)", |o| o.training),
    ];
    let mut plots: Vec<Plot> = Vec::new();
    for ((name, error), color) in series.into_iter().zip(SERIES) {
        let points: Vec<(f64, f64)> = results
            .orders
            .iter()
            .filter_map(|o| Some((o.order as f64, error(o)?.max(1e-16))))
            .collect();
        let dots = ScatterPlot::new().with_data(points.clone()).with_color(color).with_size(3.5);
        plots.push(line(points, color, 1.8).with_legend(name).into());
        plots.push(dots.into());
    }
    let layout = panel(&plots, "order", "relative error")
        .with_log_y()
        .with_legend_position(LegendPosition::OutsideRightTop)
        .with_reference_line(
            ReferenceLine::vertical(results.chosen_order as f64).with_color(PRIOR),
        );
    single(plots, layout, 760.0, 380.0)
}

/// Pairs: marginal densities with the prior on the diagonal, draws above, contours below.
pub(super) fn pairs(parameters: &[CalibratedParameter]) -> String {
    let n = parameters.len();
    let mut panels = Vec::new();
    for row in 0..n {
        for column in 0..n {
            let (x, y) = (&parameters[column], &parameters[row]);
            let label = |shown: bool, p: &CalibratedParameter| {
                if shown { p.label.clone() } else { String::new() }
            };
            let x_label = label(row == n - 1, x);
            let (plots, range) =
                if row == column { marginal(x) } else { (joint(x, y, row > column), y.prior) };
            let y_label = match (row == column, column == 0) {
                (true, _) => "density".to_owned(),
                (false, shown) => label(shown, y),
            };
            let layout = framed(panel(&plots, &x_label, &y_label), x.prior, range).with_ticks(3);
            panels.push((plots, layout));
        }
    }
    grid(n, n, panels, (300.0, 260.0))
}

fn marginal(p: &CalibratedParameter) -> (Vec<Plot>, (f64, f64)) {
    let draws: Vec<f64> = p.draws().collect();
    let edges: Vec<f64> = (0..=40).map(|i| lerp(p.prior, f64::from(i) / 40.0)).collect();
    let width = edges[1] - edges[0];
    let scale = 1.0 / (draws.len().max(1) as f64 * width);
    let density = density(&draws, p.prior);
    let flat = 1.0 / (p.prior.1 - p.prior.0);
    let counts: Vec<f64> = count(&edges, &draws).into_iter().map(|c| c * scale).collect();
    let top = counts.iter().copied().fold(flat, f64::max) * 1.15;
    let histogram = Histogram::new().with_precomputed(edges, counts).with_color("#efc9c8");
    let mut plots: Vec<Plot> = vec![histogram.into(), line(density, POSTERIOR, 2.0).into()];
    plots.push(line([(p.prior.0, flat), (p.prior.1, flat)], PRIOR, 1.6).with_dashed().into());
    plots.push(line([(p.map, 0.0), (p.map, top)], POSTERIOR, 1.2).with_dotted().into());
    if let Some(truth) = p.truth {
        plots.push(line([(truth, 0.0), (truth, top)], TRUTH, 1.8).into());
    }
    (plots, (0.0, top))
}

fn joint(x: &CalibratedParameter, y: &CalibratedParameter, contours: bool) -> Vec<Plot> {
    let pairs: Vec<(f64, f64)> = x.draws().zip(y.draws()).collect();
    let mut plots: Vec<Plot> = Vec::new();
    if contours {
        let (grid, xs, ys) = density_2d(&pairs, x.prior, y.prior);
        let levels = highest_density_levels(&grid, &[0.9, 0.5, 0.1]);
        plots.push(
            ContourPlot::new()
                .with_grid(grid, xs, ys)
                .with_levels(&levels)
                .with_line_color(POSTERIOR)
                .with_line_width(1.4)
                .into(),
        );
    } else {
        let every = (pairs.len() / 700).max(1);
        let shown = pairs.into_iter().step_by(every);
        plots.push(
            ScatterPlot::new()
                .with_data(shown)
                .with_color(POSTERIOR)
                .with_size(1.5)
                .with_marker_opacity(0.45)
                .into(),
        );
    }
    if let (Some(a), Some(b)) = (x.truth, y.truth) {
        let truth = ScatterPlot::new().with_data([(a, b)]).with_color(TRUTH).with_size(5.0);
        plots.push(truth.into());
    }
    plots
}

/// The draws in the order of sampling, one colour a chain.
pub(super) fn traces(parameters: &[CalibratedParameter]) -> String {
    let panels = parameters
        .iter()
        .map(|p| {
            let plots: Vec<Plot> = p
                .chains
                .iter()
                .zip(SERIES.iter().cycle())
                .map(|(chain, color)| {
                    let every = (chain.len() / 500).max(1);
                    let points = chain.iter().enumerate().step_by(every);
                    line(points.map(|(i, &v)| (i as f64, v)), color, 0.7).into()
                })
                .collect();
            let length = p.chains.iter().map(Vec::len).max().unwrap_or(1);
            let range = round_range(p.draws());
            let layout = framed(panel(&plots, "draw", &p.label), (0.0, length as f64), range);
            (plots, layout.with_ticks(3))
        })
        .collect();
    grid(parameters.len(), 1, panels, (900.0, 190.0))
}

fn bars(edges: &[f64], values: &[f64], color: &str) -> Plot {
    Histogram::new().with_precomputed(edges.to_vec(), count(edges, values)).with_color(color).into()
}

fn count(edges: &[f64], values: &[f64]) -> Vec<f64> {
    let bins = edges.len() - 1;
    let width = (edges[bins] - edges[0]) / bins as f64;
    let mut counts = vec![0.0; bins];
    for &value in values.iter().filter(|v| v.is_finite()) {
        let bin = ((value - edges[0]) / width).floor();
        counts[(bin.max(0.0) as usize).min(bins - 1)] += 1.0;
    }
    counts
}

fn tallest(edges: &[f64], values: &[f64]) -> f64 {
    count(edges, values).into_iter().fold(0.0, f64::max)
}

fn lerp((a, b): (f64, f64), t: f64) -> f64 {
    a + (b - a) * t
}

/// A range of round numbers around the values: steps of 1, 2 or 5 times a power of ten.
fn round_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (a, b) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let rough = ((b - a) / 8.0).max(1e-9 * b.abs()).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(rough.log10().floor());
    let step =
        power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough).unwrap_or(10.0);
    ((a / step).floor() * step, (b / step).ceil() * step)
}

/// At most `n` points of a densely measured curve.
fn thin(curve: &[(f64, f64)], n: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.iter().copied().step_by(curve.len().div_ceil(n).max(1))
}

/// Gaussian kernel density with reflection at the ends of the prior, Silverman's bandwidth.
fn density(draws: &[f64], range: (f64, f64)) -> Vec<(f64, f64)> {
    let h = bandwidth(draws, -0.2);
    let norm = 1.0 / (draws.len() as f64 * h * (2.0 * std::f64::consts::PI).sqrt());
    let kernel = |d: f64| (-0.5 * (d / h).powi(2)).exp();
    (0..=120)
        .map(|i| {
            let x = lerp(range, f64::from(i) / 120.0);
            let mirrored = |v: f64| {
                kernel(x - v) + kernel(x - (2.0 * range.0 - v)) + kernel(x - (2.0 * range.1 - v))
            };
            (x, norm * draws.iter().map(|&v| mirrored(v)).sum::<f64>())
        })
        .collect()
}

/// 1.06 σ nᵖ: p = −1/5 for one dimension, −1/6 for two.
fn bandwidth(draws: &[f64], power: f64) -> f64 {
    let m = mean(draws);
    let sd = (draws.iter().map(|v| (v - m).powi(2)).sum::<f64>() / draws.len() as f64).sqrt();
    (1.06 * sd * (draws.len() as f64).powf(power)).max(f64::MIN_POSITIVE)
}

type Grid = (Vec<Vec<f64>>, Vec<f64>, Vec<f64>);

/// Product-kernel density on a grid over the prior box, from a binned sample.
fn density_2d(pairs: &[(f64, f64)], x: (f64, f64), y: (f64, f64)) -> Grid {
    const N: usize = 48;
    let centre = |range, i: usize| lerp(range, (i as f64 + 0.5) / N as f64);
    let bin = |range: (f64, f64), v: f64| {
        let t = (v - range.0) / (range.1 - range.0);
        ((t * N as f64).max(0.0) as usize).min(N - 1)
    };
    let mut counts = vec![vec![0.0; N]; N];
    for &(a, b) in pairs {
        counts[bin(y, b)][bin(x, a)] += 1.0;
    }
    let smooth = |range: (f64, f64), values: Vec<f64>| {
        let h = bandwidth(&values, -1.0 / 6.0) / (range.1 - range.0) * N as f64;
        move |line: &[f64]| -> Vec<f64> {
            (0..N as i64)
                .map(|i| {
                    let kernel = |d: i64| (-0.5 * (d as f64 / h).powi(2)).exp();
                    let terms = line.iter().enumerate().map(|(j, &c)| {
                        let j = j as i64;
                        // images beyond both ends: the density ends at the prior
                        c * (kernel(i - j) + kernel(i + j + 1) + kernel(2 * N as i64 - 1 - i - j))
                    });
                    terms.sum()
                })
                .collect()
        }
    };
    let along_x = smooth(x, pairs.iter().map(|p| p.0).collect());
    let along_y = smooth(y, pairs.iter().map(|p| p.1).collect());
    let rows: Vec<Vec<f64>> = counts.iter().map(|row| along_x(row)).collect();
    let mut z = vec![vec![0.0; N]; N];
    for j in 0..N {
        let column: Vec<f64> = rows.iter().map(|row| row[j]).collect();
        for (i, value) in along_y(&column).into_iter().enumerate() {
            z[i][j] = value;
        }
    }
    (z, (0..N).map(|i| centre(x, i)).collect(), (0..N).map(|i| centre(y, i)).collect())
}

/// The levels that enclose these fractions of the mass.
fn highest_density_levels(grid: &[Vec<f64>], fractions: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = grid.iter().flatten().copied().collect();
    values.sort_by(|a, b| b.total_cmp(a));
    let total: f64 = values.iter().sum();
    let mut levels: Vec<f64> = fractions
        .iter()
        .map(|fraction| {
            let mut mass = 0.0;
            values
                .iter()
                .find(|&&v| {
                    mass += v;
                    mass >= fraction * total
                })
                .copied()
                .unwrap_or(0.0)
        })
        .collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn density_integrates_to_one_over_the_prior() {
        let draws: Vec<f64> = (0..400).map(|i| (f64::from(i) / 400.0).powi(2)).collect();
        let points = density(&draws, (0.0, 1.0));
        let integral: f64 =
            points.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum();
        assert!((integral - 1.0).abs() < 2e-3, "{integral}");
    }

    #[test]
    fn levels_enclose_their_fraction() {
        let pairs: Vec<(f64, f64)> = (0..5000)
            .map(|i| {
                let t = f64::from(i) * 0.618_033_988_75;
                ((t % 1.0 + (3.0 * t) % 1.0) / 2.0, ((7.0 * t) % 1.0 + (5.0 * t) % 1.0) / 2.0)
            })
            .collect();
        let (grid, xs, ys) = density_2d(&pairs, (0.0, 1.0), (0.0, 1.0));
        assert_eq!((xs.len(), ys.len()), (grid[0].len(), grid.len()));
        let levels = highest_density_levels(&grid, &[0.5]);
        let total: f64 = grid.iter().flatten().sum();
        let inside: f64 = grid.iter().flatten().filter(|&&v| v >= levels[0]).sum();
        assert!((inside / total - 0.5).abs() < 0.01);
    }

    #[test]
    fn ranges_are_round() {
        let (a, b) = round_range([0.0831, 0.1612].into_iter());
        assert!((a - 0.08).abs() < 1e-12 && (b - 0.17).abs() < 1e-12, "{a} {b}");
        assert_eq!(round_range([941.0, 2080.0].into_iter()), (800.0, 2200.0));
    }

    #[test]
    fn every_value_is_counted_once() {
        let edges = [0.0, 1.0, 2.0];
        assert_eq!(count(&edges, &[-1.0, 0.0, 1.0, 2.0, 9.0, f64::NAN]), [2.0, 3.0]);
    }
}
