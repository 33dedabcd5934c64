//! Figures of force over displacement.

use kuva::prelude::*;

use super::draw::{line, thin};
use crate::report::results::{Points, PredictedBand, Results};
use crate::report::style::{
    BASELINE, DRAWS, DRAWS_FILL, ENSEMBLE, MEASURED, POSTERIOR, panel, single,
};

/// Experimental curves over the curves of the ensemble. The range of the ensemble must include the experimental curves.
pub(in crate::report) fn curves(results: &Results) -> String {
    let mut plots = alike(results.ensemble.iter(), "ensemble", ENSEMBLE, 0.7);
    plots.extend(measured(results));
    force_displacement(plots)
}

/// Experimental curves, and simulations with the materials of the case, with posterior draws and with the
/// MAP.
pub(in crate::report) fn confirmation(results: &Results) -> String {
    let mut plots = measured(results);
    plots.extend(alike(results.posterior_curves.iter(), "posterior draws", DRAWS, 1.2));
    plots.extend(alike(results.baseline_curve.iter(), "baseline", BASELINE, 2.0));
    plots.extend(alike([&results.map_curve].into_iter(), "MAP", POSTERIOR, 2.6));
    force_displacement(plots)
}

/// Posterior predictive band of the curves of new specimens, with the experimental curves; `None` without predictions.
pub(in crate::report) fn predicted(results: &Results) -> Option<String> {
    let mut plots = band_of(results.predicted_curves.as_ref()?);
    plots.extend(measured(results));
    Some(force_displacement(plots))
}

/// Bands that contain 90 and 50 % of the curves of new specimens, and their median.
pub(super) fn band_of(band: &PredictedBand) -> Vec<Plot> {
    let PredictedBand { displacement_mm: u, force_n, .. } = band;
    let [q05, q25, q50, q75, q95] = force_n;
    let band = |low: &Vec<f64>, high: &Vec<f64>, colour: &str, name: &str| -> Plot {
        let band = BandPlot::new(u.iter().copied(), low.iter().copied(), high.iter().copied());
        band.with_color(colour).with_opacity(1.0).with_legend(name).into()
    };
    let mut plots =
        vec![band(q05, q95, DRAWS_FILL, "90 % of new ones"), band(q25, q75, DRAWS, "50 %")];
    let median = u.iter().copied().zip(q50.iter().copied());
    plots.push(line(median, POSTERIOR, 2.0).with_legend("median").into());
    plots
}

fn measured(results: &Results) -> Vec<Plot> {
    let dashed = |(i, (_, curve)): (usize, &(String, Points))| -> Plot {
        let plot = line(thin(curve, 240), MEASURED, 1.3).with_dashed();
        if i == 0 { plot.with_legend("experiments").into() } else { plot.into() }
    };
    results.experiments.iter().enumerate().map(dashed).collect()
}

/// Curves of one kind. Only the first curve has an entry in the legend.
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

/// Draws curves in axes that begin at zero: negative readings are noise.
pub(super) fn force_displacement(plots: Vec<Plot>) -> String {
    let layout = panel(&plots, "displacement (mm)", "force (N)")
        .with_x_axis_min(0.0)
        .with_y_axis_min(0.0)
        .with_legend_position(LegendPosition::InsideBottomRight);
    single(plots, layout, 470.0, 310.0)
}
