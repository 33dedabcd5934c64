//! Figures of the expected benefit of further tests.

use kuva::prelude::*;

use super::draw::line;
use crate::report::results::FurtherParameter;
use crate::report::style::{PRIOR, SERIES, framed, panel, single};

/// Expected contraction of a parameter against the number of further specimens, one line per test; dashed: the present
/// contraction.
pub(in crate::report) fn further(parameter: &FurtherParameter) -> String {
    let extreme = |f: fn(usize, usize) -> usize, first: usize| {
        let tests = parameter.tests.iter().flat_map(|test| &test.expected);
        tests.map(|expected| expected.specimens).filter(|&n| n > 0).fold(first, f) as f64
    };
    let range = match (extreme(usize::min, usize::MAX), extreme(usize::max, 1)) {
        (first, last) if first < last => (first, last),
        (only, _) => (0.5 * only, 2.0 * only),
    };
    let mut plots: Vec<Plot> = Vec::new();
    for (k, test) in parameter.tests.iter().enumerate() {
        let (colour, dashes, mark) = look(k);
        let curve = test.expected.iter().filter(|expected| expected.specimens > 0);
        let curve: Vec<(f64, f64)> = curve.map(|e| (e.specimens as f64, e.contraction)).collect();
        let marks = ScatterPlot::new().with_data(curve.clone()).with_color(colour);
        let line = line(curve, colour, 1.8).with_line_style(dashes);
        plots.push(line.with_legend(test.name.as_str()).into());
        plots.push(marks.with_size(3.5).with_marker(mark).into());
    }
    let now = [(range.0, parameter.now), (range.1, parameter.now)];
    plots.push(line(now, PRIOR, 1.4).with_dashed().with_legend("now").into());
    let low = floor(parameter);
    let y = format!("contraction of {}", parameter.label);
    let layout = framed(panel(&plots, "further specimens", &y), range, (low, 1.0))
        .with_log_x()
        .with_legend_position(LegendPosition::OutsideRightTop);
    single(plots, layout, 470.0, 280.0)
}

/// Colour, dashes and marker of the `k`-th test. When the colours repeat, dashes and marker change.
fn look(k: usize) -> (&'static str, LineStyle, MarkerShape) {
    let (dashes, mark) = match k / SERIES.len() % 4 {
        0 => (LineStyle::Solid, MarkerShape::Circle),
        1 => (LineStyle::Dashed, MarkerShape::Square),
        2 => (LineStyle::Dotted, MarkerShape::Triangle),
        _ => (LineStyle::DashDot, MarkerShape::Diamond),
    };
    (SERIES[k % SERIES.len()], dashes, mark)
}

/// Lower end of the axis: zero, or a round number below the data if all values are above 0.5.
fn floor(parameter: &FurtherParameter) -> f64 {
    let all = parameter.tests.iter().flat_map(|test| &test.expected).map(|e| e.contraction);
    let least = all.fold(parameter.now, f64::min);
    if least > 0.5 { (10.0 * least).floor() / 10.0 - 0.1 } else { least.min(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::{FurtherExpected, FurtherTestResult};

    #[test]
    fn every_test_has_its_line_and_name() {
        let expected = [1, 4, 16].map(|specimens| FurtherExpected {
            specimens,
            contraction: 1.0 - 1.0 / specimens as f64,
        });
        let test = |name: &str| FurtherTestResult {
            name: name.into(),
            expected: expected.to_vec(),
            needed: Vec::new(),
        };
        let parameter = FurtherParameter {
            label: "Gc (N/mm)".into(),
            now: 0.02,
            tests: vec![test("more specimens"), test("thirty times slower")],
        };
        let svg = further(&parameter);
        // 24 tests all look different
        let looks: std::collections::BTreeSet<String> =
            (0..24).map(|k| format!("{:?}", look(k))).collect();
        assert_eq!(looks.len(), 24);
        for part in ["Gc (N/mm)", "more specimens", "thirty times slower", "further specimens"] {
            assert!(svg.contains(part), "{part}");
        }
    }
}
