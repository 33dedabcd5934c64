//! Matrices of parameter pairs: points of the design and draws of the posterior.

use kuva::prelude::*;

use super::density::{density, density_2d, highest_density_levels};
use super::draw::{count, lerp, line};
use crate::report::results::CalibratedParameter;
use crate::report::style::{
    DESIGN, DRAWS_FILL, ENSEMBLE, POSTERIOR, PRIOR, TRUTH, framed, panel, single,
};

/// Position of a panel in the matrix of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Place {
    /// Above the diagonal: scatter plot of two parameters.
    Above,
    /// On the diagonal: histogram of one parameter.
    Diagonal,
    /// Below the diagonal: contours of the density of two parameters.
    Below,
}

/// Style in which a sample is drawn.
struct Look {
    marks: &'static str,
    bars: &'static str,
    line: &'static str,
    bins: usize,
    /// Radius of a point.
    size: f64,
    opacity: f64,
}

const OF_DESIGN: Look =
    Look { marks: DESIGN, bars: ENSEMBLE, line: DESIGN, bins: 10, size: 3.0, opacity: 0.8 };
const OF_POSTERIOR: Look = Look {
    marks: POSTERIOR,
    bars: DRAWS_FILL,
    line: POSTERIOR,
    bins: 40,
    size: 1.5,
    opacity: 0.45,
};

/// Simulations of the ensemble in the prior box, as a matrix of pairs in the layout of [`posterior`].
pub(in crate::report) fn design(parameters: &[CalibratedParameter]) -> Vec<(Place, String)> {
    let values = |p: &CalibratedParameter| p.design.clone();
    matrix(parameters, &values, &OF_DESIGN, false)
}

/// Draws of the posterior as a matrix of pairs, row by row: marginal densities with the prior on the diagonal, draws
/// above, contours below.
pub(in crate::report) fn posterior(parameters: &[CalibratedParameter]) -> Vec<(Place, String)> {
    matrix(parameters, &|p| p.draws().collect(), &OF_POSTERIOR, true)
}

fn matrix(
    parameters: &[CalibratedParameter],
    values: &dyn Fn(&CalibratedParameter) -> Vec<f64>,
    look: &Look,
    marks: bool,
) -> Vec<(Place, String)> {
    let samples: Vec<Vec<f64>> = parameters.iter().map(values).collect();
    let mut panels = Vec::new();
    for (row, y) in parameters.iter().enumerate() {
        for (column, x) in parameters.iter().enumerate() {
            let position = match row.cmp(&column) {
                std::cmp::Ordering::Less => Place::Above,
                std::cmp::Ordering::Equal => Place::Diagonal,
                std::cmp::Ordering::Greater => Place::Below,
            };
            let pairs = || samples[column].iter().copied().zip(samples[row].iter().copied());
            let (plots, range, label) = match position {
                Place::Diagonal => {
                    let (plots, range) = marginal(x, &samples[column], look, marks);
                    (plots, range, "density")
                }
                Place::Above => (scattered(pairs(), look), y.range(), y.label.as_str()),
                Place::Below => (contours(pairs(), x, y, look), y.range(), y.label.as_str()),
            };
            let mut plots = plots;
            if let (true, true, Some(a), Some(b)) =
                (marks, position != Place::Diagonal, x.truth, y.truth)
            {
                let truth = ScatterPlot::new().with_data([(a, b)]).with_color(TRUTH);
                plots.push(truth.with_size(5.0).into());
            }
            let range = if position == Place::Diagonal { range } else { axis(range) };
            let layout =
                framed(panel(&plots, &x.label, label), axis(x.range()), range).with_ticks(3);
            panels.push((position, single(plots, layout, 300.0, 260.0)));
        }
    }
    panels
}

/// Range of an axis: the bounds of the prior. A lower bound that is almost zero is replaced by zero, for round ticks.
fn axis((lower, upper): (f64, f64)) -> (f64, f64) {
    if lower > 0.0 && lower < 0.01 * upper { (0.0, upper) } else { (lower, upper) }
}

fn marginal(
    p: &CalibratedParameter,
    values: &[f64],
    look: &Look,
    marks: bool,
) -> (Vec<Plot>, (f64, f64)) {
    let bins = look.bins as f64;
    let edges: Vec<f64> = (0..=look.bins).map(|i| lerp(axis(p.range()), i as f64 / bins)).collect();
    let width = edges[1] - edges[0];
    let scale = 1.0 / (values.len().max(1) as f64 * width);
    let prior = p.prior.curve();
    let counts: Vec<f64> = count(&edges, values).into_iter().map(|c| c * scale).collect();
    let highest = prior.iter().map(|point| point.1).fold(0.0, f64::max);
    let top = counts.iter().copied().fold(highest, f64::max) * 1.15;
    let histogram = Histogram::new().with_precomputed(edges, counts).with_color(look.bars);
    let mut plots: Vec<Plot> = vec![histogram.into()];
    if !values.is_empty() {
        plots.push(line(density(values, p.range()), look.line, 2.0).into());
    }
    plots.push(line(prior, PRIOR, 1.6).with_dashed().into());
    if marks {
        plots.push(line([(p.map, 0.0), (p.map, top)], POSTERIOR, 1.2).with_dotted().into());
        plots.extend(
            p.truth.map(|truth| -> Plot { line([(truth, 0.0), (truth, top)], TRUTH, 1.8).into() }),
        );
    }
    (plots, (0.0, top))
}

fn contours(
    pairs: impl Iterator<Item = (f64, f64)>,
    x: &CalibratedParameter,
    y: &CalibratedParameter,
    look: &Look,
) -> Vec<Plot> {
    let pairs: Vec<(f64, f64)> = pairs.collect();
    if pairs.is_empty() {
        return Vec::new();
    }
    let (grid, xs, ys) = density_2d(&pairs, x.range(), y.range());
    let levels = highest_density_levels(&grid, &[0.9, 0.5, 0.1]);
    let contours = ContourPlot::new().with_grid(grid, xs, ys).with_levels(&levels);
    vec![contours.with_line_color(look.line).with_line_width(1.4).into()]
}

fn scattered(pairs: impl ExactSizeIterator<Item = (f64, f64)>, look: &Look) -> Vec<Plot> {
    let every = (pairs.len() / 700).max(1);
    let marks = ScatterPlot::new().with_data(pairs.step_by(every)).with_color(look.marks);
    vec![marks.with_size(look.size).with_marker_opacity(look.opacity).into()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;

    fn parameter(label: &str) -> CalibratedParameter {
        CalibratedParameter {
            label: label.into(),
            prior: Prior::uniform(0.0, 1.0),
            chains: vec![(0..50).map(|i| f64::from(i) / 50.0).collect()],
            design: vec![0.1, 0.7, 0.4],
            map: 0.5,
            truth: Some(0.45),
            ..Default::default()
        }
    }

    #[test]
    fn every_panel_names_both_of_its_parameters() {
        let parameters = ["E (MPa)", "Gc (N/mm)", "ξ (MPa s)"].map(parameter);
        for panels in [design(&parameters), posterior(&parameters)] {
            assert_eq!(panels.len(), 9);
            let places: Vec<Place> = panels.iter().map(|(position, _)| *position).collect();
            assert_eq!(places[..4], [Place::Diagonal, Place::Above, Place::Above, Place::Below]);
            for (i, (position, svg)) in panels.iter().enumerate() {
                assert!(svg.contains(&parameters[i % 3].label), "column of panel {i}");
                let row =
                    if *position == Place::Diagonal { "density" } else { &parameters[i / 3].label };
                assert!(svg.contains(row), "row of panel {i}");
            }
        }
        // only the posterior is compared with the true values
        assert!(posterior(&parameters)[0].1.contains(TRUTH));
        assert!(!design(&parameters)[0].1.contains(TRUTH));
    }

    #[test]
    fn a_sample_of_nothing_is_drawn() {
        let nothing =
            CalibratedParameter { chains: Vec::new(), design: Vec::new(), ..parameter("E") };
        assert_eq!(posterior(&[nothing.clone(), nothing]).len(), 4);
    }
}
