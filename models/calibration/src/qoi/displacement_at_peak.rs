//! Displacement at peak.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::{HomogeneousCylinder, Qoi};
use super::error::QoiError;
use super::unit::Unit;

/// Displacement at the peak force.
#[derive(Clone, Copy, Debug)]
pub struct DisplacementAtPeak;

impl Qoi for DisplacementAtPeak {
    fn name(&self) -> Cow<'static, str> {
        "displacement-at-peak".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "displacement_at_peak_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "displacement at peak".into()
    }

    fn unit(&self) -> Unit {
        Unit::MM
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Ok(curve.peak_mm())
    }

    fn rate(&self, _: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        Ok(rates.peak_mm)
    }

    fn of_cylinder(&self, cylinder: &HomogeneousCylinder) -> Option<f64> {
        cylinder.peak.map(|[strain, _]| strain * cylinder.height_mm)
    }
}
