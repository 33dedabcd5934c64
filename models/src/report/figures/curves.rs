//! Force over displacement.

use kuva::prelude::*;

use super::draw::{line, thin};
use crate::report::results::{Points, Results};
use crate::report::style::{BASELINE, DRAWS, ENSEMBLE, MEASURED, POSTERIOR, panel, single};

/// Experimental curves over the ensemble that has to bound them.
pub(in crate::report) fn curves(results: &Results) -> String {
    let mut plots = alike(results.ensemble.iter(), "ensemble", ENSEMBLE, 0.7);
    plots.extend(measured(results));
    force_displacement(plots)
}

/// Experiments with the simulations at the case's own materials, at posterior draws and at the MAP.
pub(in crate::report) fn confirmation(results: &Results) -> String {
    let mut plots = measured(results);
    plots.extend(alike(results.posterior_curves.iter(), "posterior draws", DRAWS, 1.2));
    plots.extend(alike(results.baseline_curve.iter(), "baseline", BASELINE, 2.0));
    plots.extend(alike([&results.map_curve].into_iter(), "MAP", POSTERIOR, 2.6));
    force_displacement(plots)
}

fn measured(results: &Results) -> Vec<Plot> {
    let dashed = |(i, (_, curve)): (usize, &(String, Points))| -> Plot {
        let plot = line(thin(curve, 240), MEASURED, 1.3).with_dashed();
        if i == 0 { plot.with_legend("experiments").into() } else { plot.into() }
    };
    results.experiments.iter().enumerate().map(dashed).collect()
}

/// Curves of one kind, of which the legend names the first.
fn alike<'a>(
    curves: impl Iterator<Item = &'a Points>,
    name: &str,
    colour: &str,
    width: f64,
) -> Vec<Plot> {
    let drawn = |(i, curve): (usize, &Points)| -> Plot {
        let plot = line(curve.iter().copied(), colour, width);
        if i == 0 { plot.with_legend(name).into() } else { plot.into() }
    };
    curves.enumerate().map(drawn).collect()
}

/// Curves from the origin: readings below it are noise.
fn force_displacement(plots: Vec<Plot>) -> String {
    let layout = panel(&plots, "displacement (mm)", "force (N)")
        .with_x_axis_min(0.0)
        .with_y_axis_min(0.0)
        .with_legend_position(LegendPosition::InsideBottomRight);
    single(plots, layout, 600.0, 350.0)
}
