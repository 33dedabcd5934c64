//! Figure of the errors of the surrogate.

use kuva::prelude::*;

use super::draw::line;
use crate::report::results::{OrderErrors, Results};
use crate::report::style::{PRIOR, SERIES, panel, single};

/// Function that selects one of the errors of an order, such as the leave-one-out error.
type ErrorOf = fn(&OrderErrors) -> Option<f64>;

/// Smallest relative error that is drawn. Smaller training errors belong to expansions that interpolate the runs.
const LEAST: f64 = 1e-6;

/// Errors of the polynomial chaos expansion against its order, on a logarithmic scale.
pub(in crate::report) fn orders(results: &Results) -> String {
    let series: [(&str, ErrorOf); 4] = [
        ("corrected LOO", |o| o.corrected),
        ("LOO", |o| o.loo),
        ("validation (30 %)", |o| o.validation),
        ("training (70 %)", |o| o.training),
    ];
    let mut plots: Vec<Plot> = Vec::new();
    for ((name, error), color) in series.into_iter().zip(SERIES) {
        let curve: Vec<(f64, f64)> = results
            .orders
            .iter()
            .filter_map(|o| Some((o.order as f64, error(o).filter(|e| *e >= LEAST)?)))
            .collect();
        let dots = ScatterPlot::new().with_data(curve.clone()).with_color(color).with_size(3.5);
        plots.push(line(curve, color, 1.8).with_legend(name).into());
        plots.push(dots.into());
    }
    let layout = panel(&plots, "order", "relative error")
        .with_log_y()
        .with_legend_position(LegendPosition::OutsideRightTop)
        .with_reference_line(
            ReferenceLine::vertical(results.chosen_order as f64).with_color(PRIOR),
        );
    single(plots, layout, 470.0, 300.0)
}
