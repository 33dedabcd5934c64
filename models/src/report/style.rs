//! Common style of all figures. No other module depends on the settings of the plotting library.

use kuva::prelude::*;

use super::ticks::with_round_ticks;

/// Colour of the experiments.
pub(super) const MEASURED: &str = "#3a3a3a";
/// Colour of the ensemble to which the surrogate was fitted.
pub(super) const ENSEMBLE: &str = "#9cc3e6";
/// Colour of the points of the ensemble in the prior box.
pub(super) const DESIGN: &str = "#1f5f99";
/// Colour of the simulation with the materials of the case (not calibrated).
pub(super) const BASELINE: &str = "#d99a2b";
/// Colour of the posterior and of quantities derived from the posterior.
pub(super) const POSTERIOR: &str = "#c0504d";
/// Colour of curves at posterior draws, and of the band that contains the central 50 % of the predicted curves.
pub(super) const DRAWS: &str = "#e3a8a6";
/// Fill colour of histograms of posterior draws.
pub(super) const DRAWS_FILL: &str = "#efc9c8";
/// Colour of the prior.
pub(super) const PRIOR: &str = "#8a8a8a";
/// Colour of the true values of virtual specimens.
pub(super) const TRUTH: &str = "#2e8b57";
/// Colours of chains and other unordered series.
pub(super) const SERIES: [&str; 6] =
    ["#1f5f99", "#c0504d", "#d99a2b", "#2e8b57", "#7a5aa6", "#4a4a4a"];

/// Colour of axes and their ticks.
const AXIS: &str = "#555555";
/// Colour of text.
const TEXT: &str = "#222222";
/// Colour of grid lines.
const GRID: &str = "#ececec";

fn theme() -> Theme {
    Theme {
        axis_color: AXIS.into(),
        tick_color: AXIS.into(),
        text_color: TEXT.into(),
        grid_color: GRID.into(),
        legend_border: "none".into(),
        font_family: Some("Helvetica, Arial, sans-serif".into()),
        ..Theme::light()
    }
}

/// Layout of a panel with axis labels.
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

/// Sets fixed ranges of both axes of a layout.
pub(super) fn framed(layout: Layout, x: (f64, f64), y: (f64, f64)) -> Layout {
    layout.with_x_axis_min(x.0).with_x_axis_max(x.1).with_y_axis_min(y.0).with_y_axis_max(y.1)
}

/// Renders one panel as SVG.
pub(super) fn single(plots: Vec<Plot>, layout: Layout, width: f64, height: f64) -> String {
    let layout = with_round_ticks(layout.with_width(width).with_height(height));
    embedded(render_to_svg(plots, layout))
}

/// Renames the clip paths of a figure, so that their names start with `figure`.
///
/// kuva numbers clip paths consecutively over all figures of a process. Without renaming, the same figure drawn twice
/// would differ, and figures of two processes could have equal names on one page.
pub(super) fn named_clips(svg: &str, figure: &str) -> String {
    const CLIP: &str = "kuva-clip-";
    let mut clip_numbers: Vec<&str> = Vec::new();
    let mut pieces = svg.split(CLIP);
    let mut named = pieces.next().unwrap_or_default().to_string();
    for piece in pieces {
        let end = piece.find(|c: char| !c.is_ascii_digit()).unwrap_or(piece.len());
        let (number, rest) = piece.split_at(end);
        let k = clip_numbers.iter().position(|seen| *seen == number).unwrap_or_else(|| {
            clip_numbers.push(number);
            clip_numbers.len() - 1
        });
        named += &format!("{figure}-clip-{k}{rest}");
    }
    named
}

/// Prepares an SVG file for a page: removes everything before `<svg`, and replaces width and height by a view box, so
/// that the page determines the size.
fn embedded(svg: String) -> String {
    let Some(start) = svg.find("<svg") else { return String::new() };
    let svg = &svg[start..];
    let side = |name: &str| {
        let value = svg.split_once(&format!(" {name}=\""))?.1;
        value.split('"').next()
    };
    match (side("width"), side("height")) {
        (Some(width), Some(height)) => {
            format!("<svg viewBox=\"0 0 {width} {height}\"{}", &svg["<svg".len()..])
        }
        _ => svg.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_can_be_of_any_size() {
        let plots = || -> Vec<Plot> { vec![LinePlot::new().with_data([(0.0, 1.0)]).into()] };
        let svg = single(plots(), panel(&plots(), "x", "y"), 760.0, 430.5);
        assert!(svg.starts_with("<svg viewBox=\"0 0 760 430.5\" "), "{}", &svg[..80]);
        assert_eq!(embedded("nothing".into()), "");
    }

    /// Returns the labels of a figure that are numbers, in the order of drawing.
    fn numeric_labels(svg: &str) -> Vec<String> {
        let texts = svg.split("<text").skip(1).filter_map(|rest| {
            let (_, text) = rest.split_once('>')?;
            Some(text.split_once("</text>")?.0.trim().to_owned())
        });
        texts.filter(|text| text.parse::<f64>().is_ok()).collect()
    }

    /// Regression test: for twelve bins of 0.0125 mm from 0.085 mm, the labels were once 0.085, 0.098, 0.11.
    #[test]
    fn labels_of_a_histogram_have_the_values_of_their_ticks() {
        let edges: Vec<f64> = (0..=12).map(|i| 0.085 + 0.0125 * f64::from(i)).collect();
        let (low, high) = (edges[0], edges[12]);
        let bars = Histogram::new().with_precomputed(edges, vec![1.0; 12]);
        let plots: Vec<Plot> = vec![bars.into()];
        let layout = framed(panel(&plots, "x", "y"), (low, high), (0.0, 1.3)).with_ticks(4);
        let labels = numeric_labels(&single(plots, layout, 400.0, 300.0));
        for ticks in [["0.10", "0.15", "0.20"], ["0.0", "0.5", "1.0"]] {
            assert!(labels.windows(3).any(|window| window == ticks), "{ticks:?} in {labels:?}");
        }
        assert!(!labels.iter().any(|label| label == "0.098"), "{labels:?}");
    }

    #[test]
    fn the_page_knows_every_colour_that_the_dark_would_change() {
        let sheet = include_str!("style.css");
        let drawn = [MEASURED, ENSEMBLE, DESIGN, POSTERIOR, DRAWS, DRAWS_FILL, AXIS, TEXT, GRID];
        for colour in drawn {
            assert!(sheet.contains(&format!("=\"{colour}\"]")), "{colour}");
        }
    }

    #[test]
    fn clip_paths_are_named_alike_whenever_a_figure_is_drawn() {
        let drawn = |first: usize| {
            format!("#kuva-clip-{first} #kuva-clip-{} #kuva-clip-{first}", first + 1)
        };
        assert_eq!(named_clips(&drawn(17), "a"), named_clips(&drawn(3), "a"));
        assert_eq!(named_clips(&drawn(17), "a"), "#a-clip-0 #a-clip-1 #a-clip-0");
    }
}
