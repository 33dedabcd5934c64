//! Slope of the unloading branch.

use std::borrow::Cow;

use super::branch_number::BranchNumber;
use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::line::{Line, Window};
use super::unit::Unit;
use crate::branch::BranchKind;

/// Slope of an unloading: slope of the least-squares line through the first half of its displacement, where the
/// curve is linear between its readings. Positive if the force falls with the displacement.
///
/// # Example
/// ```
/// use breccia_calibration::{Qoi, UnloadingSlope};
///
/// assert_eq!(UnloadingSlope::default().name(), "unloading-slope");
/// let second = UnloadingSlope::of_unloading(2).unwrap();
/// assert_eq!((&*second.name(), &*second.column()), ("unloading-slope-2", "unloading_slope_2_N_per_mm"));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct UnloadingSlope(BranchNumber);

impl Default for UnloadingSlope {
    /// The slope of the first unloading.
    fn default() -> Self {
        Self(BranchNumber::FIRST)
    }
}

impl UnloadingSlope {
    /// Creates the slope of the unloading with this number, from 1 to 1000.
    pub fn of_unloading(number: u32) -> Option<Self> {
        BranchNumber::new(number).map(Self)
    }

    /// Parses the name in a case, as in `unloading-slope-2`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        BranchNumber::between(name, "unloading-slope-", "").map(Self)
    }

    /// Parses the column of a table, as in `unloading_slope_2_N_per_mm`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        BranchNumber::between(column, "unloading_slope_", "_N_per_mm").map(Self)
    }

    /// Returns the slope of `values`, which has one number per reading of the record, over the
    /// first half of the unloading.
    fn slope(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<f64, QoiError> {
        let no_unloading =
            || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "unloading" };
        let unloading =
            curve.branches(BranchKind::Unloading).nth(self.0.earlier()).ok_or_else(no_unloading)?;
        let u = &curve.record().displacement_mm[unloading.readings.clone()];
        let (to_mm, end_mm) = (u[0], u[u.len() - 1]);
        let window = Window { from_mm: 0.5 * (to_mm + end_mm), to_mm };
        let line = Line::of(u, &values[unloading.readings.clone()], window);
        Ok(line.ok_or_else(no_unloading)?.slope)
    }
}

impl Qoi for UnloadingSlope {
    fn name(&self) -> Cow<'static, str> {
        format!("unloading-slope{}", self.0.suffix('-')).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("unloading_slope{}_N_per_mm", self.0.suffix('_')).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("unloading slope{}", self.0.suffix(' ')).into()
    }

    fn unit(&self) -> Unit {
        Unit::N_PER_MM
    }

    fn extent(&self) -> Extent {
        Extent::Unloading(self.0.get())
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
