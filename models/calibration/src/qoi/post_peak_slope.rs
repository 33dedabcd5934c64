//! Slope of the falling branch.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::line::{Line, Window, slope_line};
use super::slope::rate_of_slope;
use super::unit::Unit;

/// Middle of the window, divided by the displacement at peak.
const MIDDLE: f64 = 1.2;
/// End of the window, divided by the displacement at peak.
const END: f64 = 1.3;

/// Slope of the falling branch, negative if the force falls: the slope of the least-squares line through the curve from
/// 1.1 to 1.3 times the displacement at peak.
#[derive(Clone, Copy, Debug)]
pub struct PostPeakSlope;

impl PostPeakSlope {
    /// Fits the line whose slope is the slope past the peak.
    ///
    /// # Errors
    /// If the curve ends before the end of the window, or the window contains no reading.
    fn line(&self, curve: &PeakedCurve<'_>) -> Result<Line, QoiError> {
        let window = Window::around(MIDDLE, curve.peak_mm());
        let displacements = curve.curve().displacement_mm.iter().copied();
        if displacements.fold(f64::NEG_INFINITY, f64::max) < window.to_mm * (1.0 - 1e-9) {
            return Err(self.not_reached(curve, window.to_mm));
        }
        slope_line(curve.curve(), window)
    }
}

impl Qoi for PostPeakSlope {
    fn name(&self) -> Cow<'static, str> {
        "post-peak-slope".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "post_peak_slope_N_per_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "slope past the peak".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_PER_MM
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn extent(&self) -> Extent {
        Extent::Fraction(END)
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Ok(self.line(curve)?.slope)
    }

    /// The window moves with the displacement at peak.
    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        Ok(rate_of_slope(curve, rates, MIDDLE, &self.line(curve)?))
    }
}
