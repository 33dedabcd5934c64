//! Force of a curve at a fraction of the displacement at peak, or at a given displacement.

use super::error::QoiError;
use super::fits::Polynomial;
use super::quantity::Quantity;
use crate::experiment::TestCurve;

/// Half width of the window around a reading: a fraction of the displacement at peak, or, for a reading at a fixed
/// displacement, a fraction of that displacement.
const WINDOW: f64 = 0.1;

/// Force and slope of a curve at one displacement. Both are taken from a least-squares parabola through the surrounding
/// points, at least three, so that neither the load step nor a single noisy point decides the result.
pub(super) struct Reading {
    /// Force, N.
    pub(super) force: f64,
    /// Slope, N/mm.
    pub(super) slope: f64,
}

/// Displacement at which a curve is read, with the window of points that are used.
pub(super) struct Place {
    quantity: Quantity,
    /// Displacement, mm.
    at: f64,
    /// Half width of the window, mm.
    half_width: f64,
}

impl Place {
    /// Place at a percentage of the displacement at peak.
    pub(super) fn of_the_peak(percent: u8, peak_mm: f64) -> Self {
        Self {
            quantity: Quantity::RelativeForce(percent),
            at: 0.01 * f64::from(percent) * peak_mm,
            half_width: WINDOW * peak_mm,
        }
    }

    /// Place at a displacement in µm. The window does not move with the peak, so that the result is linear in the
    /// forces of the curve.
    pub(super) fn fixed(place_um: u32) -> Self {
        let at = f64::from(place_um) / 1000.0;
        Self { quantity: Quantity::ForceAt(place_um), at, half_width: WINDOW * at }
    }

    /// Reads values at the points of a curve: forces (N) or derivatives of the forces.
    ///
    /// # Errors
    /// If the curve ends before the place or begins after it.
    pub(super) fn read(&self, curve: &TestCurve, values: &[f64]) -> Result<Reading, QoiError> {
        let u = || curve.displacement_mm.iter().copied();
        let mut points: Vec<(f64, f64)> = u().zip(values).map(|(u, y)| (u - self.at, *y)).collect();
        // a point on the border belongs to the window in spite of rounding errors
        let half = self.half_width * (1.0 + 1e-9);
        let reaches = |ahead: f64| points.iter().any(|(u, _)| ahead * u >= -1e-8 * half);
        if !reaches(1.0) || !reaches(-1.0) {
            return Err(QoiError::NotReached {
                quantity: self.quantity,
                place_mm: self.at,
                from_mm: u().fold(f64::INFINITY, f64::min),
                to_mm: u().fold(f64::NEG_INFINITY, f64::max),
            });
        }
        points.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        let inside = points.iter().take_while(|(u, _)| u.abs() <= half).count();
        points.truncate(inside.max(3));
        let parabola = Polynomial::of(&points, 2).jet(0.0);
        Ok(Reading { force: parabola.value, slope: parabola.slope })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qoi::Qois;

    const SHAPE: [Quantity; 4] = [
        Quantity::RelativeForce(20),
        Quantity::RelativeForce(50),
        Quantity::RelativeForce(100),
        Quantity::RelativeForce(110),
    ];

    fn curve(step_mm: f64, force: impl Fn(f64) -> f64) -> TestCurve {
        let displacement_mm: Vec<f64> =
            (0..).map(|i| step_mm * f64::from(i)).take_while(|&u| u < 0.16).collect();
        TestCurve { force_n: displacement_mm.iter().map(|&u| force(u)).collect(), displacement_mm }
    }

    #[test]
    fn the_shape_of_a_parabola_is_read_exactly_wherever_its_points_lie() {
        for step in [0.0131, 0.0057, 0.000_31] {
            let curve = curve(step, |u| 147.0 * (1.0 - (1.0 - u / 0.1217).powi(2)));
            let found = Qois::values_of(&curve, 0.3, &SHAPE).unwrap();
            for (found, part) in found.iter().zip([0.2, 0.5, 1.0, 1.1_f64]) {
                let exact = 1.0 - (1.0 - part).powi(2);
                assert!((found / exact - 1.0).abs() < 1e-9, "{step} {part}: {found} {exact}");
            }
        }
    }

    /// Curves x e^((1 − x³)/3), where x is the displacement divided by the displacement at peak: the viscous limit of
    /// definitions 3.3. Relative forces do not depend on the other constants.
    #[test]
    fn curves_of_one_shape_read_alike() {
        for (peak, step) in [(0.06, 0.005), (0.12, 0.005), (0.12, 0.001)] {
            let curve = curve(step, |u| 1200.0 * u * (-(u / peak).powi(3) / 3.0).exp());
            let found = Qois::values_of(&curve, 0.3, &SHAPE).unwrap();
            for (found, x) in found.iter().zip([0.2, 0.5, 1.0, 1.1_f64]) {
                let exact = x * ((1.0 - x.powi(3)) / 3.0).exp();
                assert!((found / exact - 1.0).abs() < 6e-3, "{peak} {step} {x}: {found} {exact}");
            }
        }
    }

    #[test]
    fn a_curve_that_ends_before_says_where() {
        let mut short = curve(0.005, |u| 147.0 * (1.0 - (1.0 - u / 0.12).powi(2)));
        short.displacement_mm.truncate(27);
        short.force_n.truncate(27);
        let error = Qois::values_of(&short, 0.3, &SHAPE).unwrap_err();
        let message = error.to_string();
        assert!(
            matches!(error, QoiError::NotReached { quantity: Quantity::RelativeForce(110), .. }),
            "{error:?}"
        );
        assert!(message.contains("110 %") && message.contains("0.13"), "{message}");
        assert!(Qois::values_of(&short, 0.3, &SHAPE[..3]).is_ok());
    }
    #[test]
    fn the_force_at_a_displacement_is_read_whatever_the_peak() {
        for (step, peak) in [(0.0131, 0.1217), (0.0057, 0.08), (0.000_31, 0.1)] {
            let curve = curve(step, |u| 147.0 * (1.0 - (1.0 - u / peak).powi(2)));
            let places = [20, 50, 123].map(Quantity::ForceAt);
            let found = Qois::values_of(&curve, 0.3, &places).unwrap();
            for (found, place) in found.iter().zip([0.02, 0.05, 0.123_f64]) {
                let exact = 147.0 * (1.0 - (1.0 - place / peak).powi(2));
                assert!((found / exact - 1.0).abs() < 1e-9, "{step} {place}: {found} {exact}");
            }
            let error = Qois::values_of(&curve, 0.3, &[Quantity::ForceAt(200)]).unwrap_err();
            assert!(error.to_string().contains("0.2000 mm for force-at-0.2-mm"), "{error}");
        }
    }
}
