//! One look for every figure: the only place that knows the plotting library's settings.

use kuva::prelude::*;

/// Experiments.
pub(super) const MEASURED: &str = "#3a3a3a";
/// The ensemble that trained the surrogate.
pub(super) const ENSEMBLE: &str = "#9cc3e6";
/// The posterior and what follows from it.
pub(super) const POSTERIOR: &str = "#c0504d";
/// The prior.
pub(super) const PRIOR: &str = "#8a8a8a";
/// The truth of virtual specimens.
pub(super) const TRUTH: &str = "#2e8b57";
/// Chains and other unordered series.
pub(super) const SERIES: [&str; 6] =
    ["#1f5f99", "#c0504d", "#d99a2b", "#2e8b57", "#7a5aa6", "#4a4a4a"];

fn theme() -> Theme {
    Theme {
        axis_color: "#555555".into(),
        tick_color: "#555555".into(),
        text_color: "#222222".into(),
        grid_color: "#ececec".into(),
        legend_border: "none".into(),
        font_family: Some("Helvetica, Arial, sans-serif".into()),
        ..Theme::light()
    }
}

/// A panel with its labels.
pub(super) fn panel(plots: &[Plot], x: &str, y: &str) -> Layout {
    Layout::auto_from_plots(plots)
        .with_theme(theme())
        .with_x_label(x)
        .with_y_label(y)
        .with_label_size(14)
        .with_tick_size(12)
        .with_body_size(12)
        .with_ticks(5)
}

/// The same panel over fixed ranges.
pub(super) fn framed(layout: Layout, x: (f64, f64), y: (f64, f64)) -> Layout {
    layout.with_x_axis_min(x.0).with_x_axis_max(x.1).with_y_axis_min(y.0).with_y_axis_max(y.1)
}

/// One panel as SVG.
pub(super) fn single(plots: Vec<Plot>, layout: Layout, width: f64, height: f64) -> String {
    strip(render_to_svg(plots, layout.with_width(width).with_height(height)))
}

/// The same figure with clip paths named after it.
///
/// kuva counts them on from figure to figure: without this the same figure drawn twice differs, and two
/// figures from two processes have the same names on one page.
pub(super) fn named_clips(svg: &str, figure: &str) -> String {
    const CLIP: &str = "kuva-clip-";
    let mut numbers: Vec<&str> = Vec::new();
    let mut parts = svg.split(CLIP);
    let mut named = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_digit()).unwrap_or(part.len());
        let (number, rest) = part.split_at(end);
        let k = numbers.iter().position(|seen| *seen == number).unwrap_or_else(|| {
            numbers.push(number);
            numbers.len() - 1
        });
        named += &format!("{figure}-clip-{k}{rest}");
    }
    named
}

/// A grid of panels as SVG.
pub(super) fn grid(
    rows: usize,
    columns: usize,
    panels: Vec<(Vec<Plot>, Layout)>,
    cell: (f64, f64),
) -> String {
    let (plots, layouts) = panels.into_iter().unzip();
    let scene = Figure::new(rows, columns)
        .with_plots(plots)
        .with_layouts(layouts)
        .with_cell_size(cell.0, cell.1)
        .with_spacing(14.0)
        .with_padding(6.0)
        .render();
    strip(SvgBackend.render_scene(&scene))
}

/// Everything before `<svg` is for files, not for pages.
fn strip(svg: String) -> String {
    svg.find("<svg").map_or_else(String::new, |start| svg[start..].to_owned())
}
