//! Figures for calibrations that a user programs: curves, bands and points, in the style of the
//! report.

use std::fmt;
use std::io;
use std::path::Path;

use kuva::prelude::*;
use ppl::diagnostics::quantile;

use super::style::{DESIGN, MEASURED, POSTERIOR, PRIOR, SERIES, TRUTH, panel};
use super::ticks::with_round_ticks;

/// Meaning of a colour in the figures of the report.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// Experiments.
    Measured,
    /// The posterior, and quantities that are derived from the posterior.
    Posterior,
    /// A second posterior, for comparison.
    Other,
    /// The prior.
    Prior,
    /// The true parameters of virtual specimens.
    Truth,
    /// A member of a series, such as a specimen or a chain.
    Series(usize),
}

impl Ink {
    fn colour(self) -> &'static str {
        match self {
            Self::Measured => MEASURED,
            Self::Posterior => POSTERIOR,
            Self::Other => DESIGN,
            Self::Prior => PRIOR,
            Self::Truth => TRUTH,
            Self::Series(k) => SERIES[k % SERIES.len()],
        }
    }
}

/// One panel of curves, bands and points.
///
/// # Example
/// ```no_run
/// use models::report::{Chart, Ink};
///
/// let x = [0.0, 0.1, 0.2];
/// let draws = [vec![0.0, 1.0, 1.9], vec![0.0, 1.1, 2.1], vec![0.0, 0.9, 2.0]];
/// let chart = Chart::new("displacement (mm)", "force (N)")
///     .band("90 % of predictions", Ink::Posterior, &x, &draws, 0.9)
///     .points("measured", Ink::Measured, [(0.1, 1.02), (0.2, 1.97)]);
/// Chart::write_png("prediction.png".as_ref(), vec![chart])?;
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct Chart {
    x_label: String,
    y_label: String,
    title: Option<String>,
    x_range: Option<(f64, f64)>,
    y_range: Option<(f64, f64)>,
    legend: LegendPosition,
    plots: Vec<Plot>,
}

impl fmt::Debug for Chart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Chart");
        shown.field("x_label", &self.x_label).field("y_label", &self.y_label);
        shown.finish_non_exhaustive()
    }
}

impl Chart {
    /// Creates an empty panel; the labels should contain the units.
    pub fn new(x_label: &str, y_label: &str) -> Self {
        Self {
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            title: None,
            x_range: None,
            y_range: None,
            legend: LegendPosition::InsideBottomRight,
            plots: Vec::new(),
        }
    }

    /// Adds a title above the panel.
    pub fn titled(self, title: &str) -> Self {
        Self { title: Some(title.to_owned()), ..self }
    }

    /// Sets fixed ranges of both axes, instead of the ranges of the data.
    pub fn over(self, x: (f64, f64), y: (f64, f64)) -> Self {
        Self { x_range: Some(x), y_range: Some(y), ..self }
    }

    /// Places the legend at the top left, for falling curves.
    pub fn legend_above_left(self) -> Self {
        Self { legend: LegendPosition::InsideTopLeft, ..self }
    }

    /// Places the legend at the top right.
    pub fn legend_above_right(self) -> Self {
        Self { legend: LegendPosition::InsideTopRight, ..self }
    }

    /// Adds a line through points; a line with an empty name is not in the legend.
    pub fn line(self, name: &str, ink: Ink, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let line = LinePlot::new().with_data(points).with_color(ink.colour());
        let line = line.with_stroke_width(2.0);
        self.with(if name.is_empty() { line } else { line.with_legend(name) })
    }

    /// Adds a thin line, for many curves over bands; otherwise as [`line`](Self::line).
    pub fn thin(self, name: &str, ink: Ink, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let line = LinePlot::new().with_data(points).with_color(ink.colour());
        let line = line.with_stroke_width(0.7);
        self.with(if name.is_empty() { line } else { line.with_legend(name) })
    }

    /// Adds a dashed line; otherwise as [`line`](Self::line).
    pub fn dashed(
        self,
        name: &str,
        ink: Ink,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let line = LinePlot::new().with_data(points).with_color(ink.colour());
        let line = line.with_stroke_width(1.6).with_dashed();
        self.with(if name.is_empty() { line } else { line.with_legend(name) })
    }

    /// Adds points.
    pub fn points(
        self,
        name: &str,
        ink: Ink,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        let plot = ScatterPlot::new().with_data(points).with_color(ink.colour()).with_size(3.0);
        self.with(if name.is_empty() { plot } else { plot.with_legend(name) })
    }

    /// Adds vertical bars from a lower to an upper end, with a point between them: (x, lower end, point, upper end).
    pub fn intervals(self, name: &str, ink: Ink, bars: impl IntoIterator<Item = [f64; 4]>) -> Self {
        let bars: Vec<[f64; 4]> = bars.into_iter().collect();
        let middles: Vec<(f64, f64)> = bars.iter().map(|b| (b[0], b[2])).collect();
        let upright = |chart: Self, b: &[f64; 4]| chart.line("", ink, [(b[0], b[1]), (b[0], b[3])]);
        bars.iter().fold(self, upright).points(name, ink, middles)
    }

    /// Adds the band that contains the central `probability` of the curves at each x, and their median. Each curve has
    /// a value for each x; values that are not finite are omitted.
    pub fn band(
        self,
        name: &str,
        ink: Ink,
        x: &[f64],
        curves: &[Vec<f64>],
        probability: f64,
    ) -> Self {
        let at = |i: usize| {
            let finite = |curve: &Vec<f64>| curve.get(i).copied().filter(|v| v.is_finite());
            let values: Vec<f64> = curves.iter().filter_map(finite).collect();
            [0.5 - 0.5 * probability, 0.5, 0.5 + 0.5 * probability].map(|p| quantile(&values, p))
        };
        let ends: Vec<[f64; 3]> = (0..x.len()).map(at).collect();
        let column = |k: usize| ends.iter().map(move |row| row[k]);
        let band = BandPlot::new(x.to_vec(), column(0), column(2));
        let band = band.with_color(ink.colour()).with_opacity(0.25);
        let median: Vec<(f64, f64)> = x.iter().copied().zip(column(1)).collect();
        self.with(band).line(name, ink, median)
    }

    fn with(mut self, plot: impl Into<Plot>) -> Self {
        self.plots.push(plot.into());
        self
    }

    /// Writes panels side by side as a PNG file.
    ///
    /// # Errors
    /// If `panels` is empty, or the file cannot be written.
    pub fn write_png(file: &Path, panels: Vec<Self>) -> io::Result<()> {
        std::fs::write(file, Self::to_png(panels)?)
    }

    /// Draws panels side by side and returns the bytes of a PNG file.
    ///
    /// # Errors
    /// If `panels` is empty.
    pub fn to_png(panels: Vec<Self>) -> io::Result<Vec<u8>> {
        if panels.is_empty() {
            return Err(io::Error::other("a figure without panels"));
        }
        let count = panels.len();
        let (layouts, plots) = panels.into_iter().map(Self::drawn).unzip();
        let figure = Figure::new(1, count)
            .with_plots(plots)
            .with_layouts(layouts)
            .with_cell_size(WIDTH, HEIGHT)
            .with_keep_panel_legends();
        PngBackend::new().with_scale(SCALE).render_scene(&figure.render()).map_err(io::Error::other)
    }

    fn drawn(self) -> (Layout, Vec<Plot>) {
        let mut layout = panel(&self.plots, &self.x_label, &self.y_label);
        layout = layout.with_legend_position(self.legend);
        if let Some(title) = &self.title {
            layout = layout.with_title(title.as_str()).with_title_size(14);
        }
        if let Some((low, high)) = self.x_range {
            layout = layout.with_x_axis_min(low).with_x_axis_max(high);
        }
        if let Some((low, high)) = self.y_range {
            layout = layout.with_y_axis_min(low).with_y_axis_max(high);
        }
        (with_round_ticks(layout), self.plots)
    }
}

/// Width and height of a panel in units of the drawing, and number of pixels per unit.
const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 340.0;
const SCALE: f32 = 1.5;

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(panels: Vec<Chart>) -> (usize, usize, Vec<u8>) {
        let bytes = Chart::to_png(panels).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(bytes)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width as usize, info.height as usize, pixels)
    }

    /// The line has the colour of the truth, #2e8b57, and a picture of two panels is twice as wide.
    #[test]
    fn panels_stand_side_by_side() {
        let chart = || Chart::new("x", "y").line("line", Ink::Truth, [(0.0, 1.0), (1.0, 1.0)]);
        let (width, height, one) = pixels(vec![chart()]);
        let (both, same, _) = pixels(vec![chart(), chart()]);
        assert!(height == same && both > 19 * width / 10, "{width} {both}");
        let green = one.chunks(4).filter(|p| p[..3] == [0x2e, 0x8b, 0x57]).count();
        assert!(green > width / 3, "{green} pixels of {width}");
        assert!(Chart::to_png(Vec::new()).is_err());
    }

    #[test]
    fn a_band_holds_the_middle_of_finite_curves() {
        let mut curves: Vec<Vec<f64>> = (0..=100).map(|i| vec![f64::from(i)]).collect();
        curves.push(vec![f64::NAN]);
        let chart = Chart::new("x", "y").band("band", Ink::Posterior, &[1.0], &curves, 0.9);
        let Plot::Band(band) = &chart.plots[0] else { panic!("a band first") };
        assert!((band.y_lower[0] - 5.0).abs() < 1e-9 && (band.y_upper[0] - 95.0).abs() < 1e-9);
    }
}
