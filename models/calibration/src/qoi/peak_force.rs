//! Peak force.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::{HomogeneousCylinder, Qoi};
use super::error::QoiError;
use super::unit::Unit;

/// Peak force of the curve.
#[derive(Clone, Copy, Debug)]
pub struct PeakForce;

impl Qoi for PeakForce {
    fn name(&self) -> Cow<'static, str> {
        "peak-force".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "peak_force_N".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "peak force".into()
    }

    fn unit(&self) -> Unit {
        Unit::N
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Ok(curve.peak_force_n())
    }

    fn rate(&self, _: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        Ok(rates.peak_force_n)
    }

    fn of_cylinder(&self, cylinder: &HomogeneousCylinder) -> Option<f64> {
        cylinder.peak.map(|[_, stress_mpa]| stress_mpa * cylinder.area_mm2)
    }
}
