//! Slope of the unloading branch.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::line::{Line, Window};
use super::unit::Unit;
use crate::branch::BranchKind;

/// Slope of the first unloading: slope of the least-squares line through the first half of its displacement, where the
/// curve is linear between its readings. Positive if the force falls with the displacement.
#[derive(Clone, Copy, Debug)]
pub struct UnloadingSlope;

impl UnloadingSlope {
    /// Returns the slope of `values`, which has one number per reading of the record, over the
    /// first half of the first unloading.
    fn slope(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<f64, QoiError> {
        let no_unloading =
            || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "unloading" };
        let unloading = curve.branches(BranchKind::Unloading).next().ok_or_else(no_unloading)?;
        let u = &curve.record().displacement_mm[unloading.readings.clone()];
        let (to_mm, end_mm) = (u[0], u[u.len() - 1]);
        let window = Window { from_mm: 0.5 * (to_mm + end_mm), to_mm };
        let line = Line::of(u, &values[unloading.readings.clone()], window);
        Ok(line.ok_or_else(no_unloading)?.slope)
    }
}

impl Qoi for UnloadingSlope {
    fn name(&self) -> Cow<'static, str> {
        "unloading-slope".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "unloading_slope_N_per_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "unloading slope".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_PER_MM
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
        self.slope(curve, &curve.record().force_n)
    }

    /// The window depends on displacements only, so that the slope is linear in the forces.
    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.slope(curve, rates.record_n)
    }
}
