//! Slope of the rising branch.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::{HomogeneousCylinder, Qoi};
use super::error::QoiError;
use super::line::{Line, Window, slope_line};
use super::unit::Unit;

/// Slope of the rising branch: slope of the least-squares line through the curve, taken as linear between its readings,
/// at displacements d with |d − f·d_F| ≤ 0.1 d_F, where f is the slope fraction and d_F the displacement at peak.
///
/// The line is fitted to the curve and not to the single readings, so that the slope is a smooth function of d_F. For
/// dense readings, this slope equals the slope of the least-squares line through the readings. In the paper, section
/// "Quantities of Interest", the slope is taken at 0.3 d_F for simulations and five tests and at 0.55 d_F for seven
/// tests.
#[derive(Clone, Copy, Debug)]
pub struct Slope;

impl Qoi for Slope {
    fn name(&self) -> Cow<'static, str> {
        "slope".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "slope_N_per_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "initial slope".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_PER_MM
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        let window = Window::around(curve.slope_fraction(), curve.peak_mm());
        Ok(slope_line(curve.curve(), window)?.slope)
    }

    /// The window moves with the displacement at peak. If it did not move, the slope of viscous damage (F ∝ v exp(−x³/3)
    /// with x = u/d_F, d_F ~ ξ^(1/3)) would seem to grow like ξ^0.04, although it does not depend on the viscosity ξ.
    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        let fraction = curve.slope_fraction();
        let line = slope_line(curve.curve(), Window::around(fraction, curve.peak_mm()))?;
        Ok(rate_of_slope(curve, rates, fraction, &line))
    }

    fn of_cylinder(&self, cylinder: &HomogeneousCylinder) -> Option<f64> {
        Some(cylinder.young_mpa * cylinder.area_mm2 / cylinder.height_mm)
    }
}

/// Returns the derivative of the slope of `line`, whose window is centred at `fraction` times the displacement at
/// peak and moves with this displacement.
pub(super) fn rate_of_slope(
    curve: &PeakedCurve<'_>,
    rates: &CurveRates<'_>,
    fraction: f64,
    line: &Line,
) -> f64 {
    let ends = Window::parts(fraction).into_iter().zip(line.slope_by_ends);
    let by_window: f64 = ends.map(|(end, by)| end * by).sum();
    let window = Window::around(fraction, curve.peak_mm());
    let fixed = Line::of(&curve.curve().displacement_mm, rates.force_n, window);
    fixed.map_or(0.0, |line| line.slope) + by_window * rates.peak_mm
}
