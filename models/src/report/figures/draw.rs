//! Helpers that several figures share.

use kuva::prelude::*;

pub(super) fn line(
    points: impl IntoIterator<Item = (f64, f64)>,
    color: &str,
    width: f64,
) -> LinePlot {
    LinePlot::new().with_data(points).with_color(color).with_stroke_width(width)
}

pub(super) fn count(edges: &[f64], values: &[f64]) -> Vec<f64> {
    let bins = edges.len() - 1;
    let width = (edges[bins] - edges[0]) / bins as f64;
    let mut counts = vec![0.0; bins];
    for &value in values.iter().filter(|v| v.is_finite()) {
        let bin = ((value - edges[0]) / width).floor();
        counts[(bin.max(0.0) as usize).min(bins - 1)] += 1.0;
    }
    counts
}

pub(super) fn lerp((a, b): (f64, f64), t: f64) -> f64 {
    a + (b - a) * t
}

/// Returns a range with round ends that contains the values: multiples of 1, 2 or 5 times a power of ten.
pub(super) fn round_range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (a, b) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let rough = ((b - a) / 8.0).max(1e-9 * b.abs()).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(rough.log10().floor());
    let step =
        power * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * power >= rough).unwrap_or(10.0);
    ((a / step).floor() * step, (b / step).ceil() * step)
}

/// Reduces a densely measured curve to at most `n` points.
pub(super) fn thin(curve: &[(f64, f64)], n: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
    curve.iter().copied().step_by(curve.len().div_ceil(n).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

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
