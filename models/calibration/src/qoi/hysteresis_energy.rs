//! Work that a specimen does not return in a cycle of loading and unloading.

use std::borrow::Cow;

use super::branch_number::BranchNumber;
use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::unit::Unit;
use crate::branch::BranchKind;

/// Work of the force in a cycle, ∫ F du by the trapezoidal rule: the work of loading minus the work that unloading returns.
/// A cycle ends with its unloading. It begins at the end of the unloading before, and the first cycle begins at the start.
/// Zero for an elastic specimen that is unloaded completely.
#[derive(Clone, Copy, Debug)]
pub struct HysteresisEnergy(BranchNumber);

impl Default for HysteresisEnergy {
    /// The energy of the first cycle.
    fn default() -> Self {
        Self(BranchNumber::FIRST)
    }
}

impl HysteresisEnergy {
    /// Creates the energy of the cycle with this number, from 1 to 1000.
    pub fn of_cycle(number: u32) -> Option<Self> {
        BranchNumber::new(number).map(Self)
    }

    /// Parses the name in a case, as in `hysteresis-energy-2`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        BranchNumber::between(name, "hysteresis-energy-", "").map(Self)
    }

    /// Parses the column of a table, as in `hysteresis_energy_2_N_mm`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        BranchNumber::between(column, "hysteresis_energy_", "_N_mm").map(Self)
    }

    /// ∫ y du of `values` of the record over the cycle.
    fn integral(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<f64, QoiError> {
        let no_unloading =
            || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "unloading" };
        let mut unloadings = curve.branches(BranchKind::Unloading);
        let start = match self.0.earlier().checked_sub(1) {
            Some(before) => unloadings.nth(before).ok_or_else(no_unloading)?.readings.end - 1,
            None => 0,
        };
        let cycle = start..unloadings.next().ok_or_else(no_unloading)?.readings.end;
        let u = &curve.record().displacement_mm[cycle.clone()];
        let steps = u.windows(2).zip(values[cycle].windows(2));
        Ok(steps.map(|(u, y)| 0.5 * (y[0] + y[1]) * (u[1] - u[0])).sum())
    }
}

impl Qoi for HysteresisEnergy {
    fn name(&self) -> Cow<'static, str> {
        format!("hysteresis-energy{}", self.0.suffix('-')).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("hysteresis_energy{}_N_mm", self.0.suffix('_')).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("hysteresis energy{}", self.0.suffix(' ')).into()
    }

    fn unit(&self) -> Unit {
        Unit::N_MM
    }

    fn is_positive(&self) -> bool {
        false
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
        self.integral(curve, &curve.record().force_n)
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.integral(curve, rates.record_n)
    }
}
