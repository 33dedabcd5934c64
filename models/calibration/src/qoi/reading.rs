//! Value and slope of a curve at one displacement.

use super::fits::Polynomial;

/// Half width of the window around a reading, divided by the displacement at peak or by the fixed displacement of the
/// reading.
pub(super) const HALF_WIDTH: f64 = 0.1;

/// Value and slope of a curve at one displacement. Both are computed from a least-squares parabola through the
/// surrounding points (at least three), so that the result depends little on the load step and on a single noisy
/// point.
pub(super) struct Reading {
    pub(super) value: f64,
    /// Derivative of the value with respect to displacement, per mm.
    pub(super) slope: f64,
}

impl Reading {
    /// Reads `values` at the displacements `u` (mm), at `at_mm` with a window of half width `half_mm`. Returns `None` if
    /// the curve ends before or begins after `at_mm`.
    pub(super) fn of(u: &[f64], values: &[f64], at_mm: f64, half_mm: f64) -> Option<Self> {
        let mut shifted_readings: Vec<(f64, f64)> =
            u.iter().zip(values).map(|(u, y)| (u - at_mm, *y)).collect();
        // a point on the border belongs to the window in spite of rounding errors
        let half = half_mm * (1.0 + 1e-9);
        let reaches = |ahead: f64| shifted_readings.iter().any(|(u, _)| ahead * u >= -1e-8 * half);
        if !reaches(1.0) || !reaches(-1.0) {
            return None;
        }
        shifted_readings.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let inside = shifted_readings.iter().take_while(|(u, _)| u.abs() <= half).count();
        shifted_readings.truncate(inside.max(3));
        let parabola = Polynomial::of(&shifted_readings, 2).jet(0.0);
        Some(Self { value: parabola.value, slope: parabola.slope })
    }
}
