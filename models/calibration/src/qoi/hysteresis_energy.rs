//! Work that a specimen does not return in the first cycle of loading and unloading.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::unit::Unit;
use crate::branch::BranchKind;

/// Work of the force from the start to the end of the first unloading, ∫ F du, by the trapezoidal rule: the work of
/// loading minus the work that unloading returns. Zero for an elastic specimen that is unloaded completely.
#[derive(Clone, Copy, Debug)]
pub struct HysteresisEnergy;

impl HysteresisEnergy {
    /// ∫ y du of `values` of the record to the end of the first unloading.
    fn integral(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<f64, QoiError> {
        let no_unloading =
            || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "unloading" };
        let unloading = curve.branches(BranchKind::Unloading).next().ok_or_else(no_unloading)?;
        let end = unloading.readings.end;
        let u = &curve.record().displacement_mm[..end];
        let steps = u.windows(2).zip(values[..end].windows(2));
        Ok(steps.map(|(u, y)| 0.5 * (y[0] + y[1]) * (u[1] - u[0])).sum())
    }
}

impl Qoi for HysteresisEnergy {
    fn name(&self) -> Cow<'static, str> {
        "hysteresis-energy".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "hysteresis_energy_N_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "hysteresis energy".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_MM
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn extent(&self) -> Extent {
        Extent::Unloading
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn needs_time(&self) -> bool {
        true
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        self.integral(curve, &curve.record().force_n)
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.integral(curve, rates.record_n)
    }
}
