//! Force at a fixed displacement.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;

/// Force at a displacement. The window in which the force is read does not move with the peak, so that the quantity
/// is linear in the forces of the curve.
#[derive(Clone, Copy, Debug)]
pub struct ForceAt {
    /// Whole number of µm, so that names and columns are exact.
    displacement_um: u32,
}

impl ForceAt {
    /// Creates the quantity for a displacement of a positive whole number of µm.
    pub fn micrometres(displacement_um: u32) -> Option<Self> {
        (displacement_um > 0).then_some(Self { displacement_um })
    }

    /// Parses the name in a case, as in `force-at-0.05-mm`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Self::of_millimetres(name.strip_prefix("force-at-")?.strip_suffix("-mm")?)
    }

    /// Parses the column of a table, as in `force_at_0.05_mm_N`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        Self::of_millimetres(column.strip_prefix("force_at_")?.strip_suffix("_mm_N")?)
    }

    /// Parses a number of mm that is a whole number of µm.
    fn of_millimetres(text: &str) -> Option<Self> {
        let displacement_um = 1000.0 * text.parse::<f64>().ok()?;
        let whole = displacement_um.round();
        let is_whole =
            (1.0..=f64::from(u32::MAX)).contains(&whole) && (displacement_um - whole).abs() < 1e-6;
        is_whole.then_some(Self { displacement_um: whole as u32 })
    }

    fn displacement_mm(self) -> f64 {
        f64::from(self.displacement_um) / 1000.0
    }

    /// Reads `values` at the points of the curve, at the displacement of this quantity.
    fn read(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<f64, QoiError> {
        let at_mm = self.displacement_mm();
        let u = &curve.curve().displacement_mm;
        let reading = Reading::of(u, values, at_mm, HALF_WIDTH * at_mm);
        Ok(reading.ok_or_else(|| self.not_reached(curve, at_mm))?.value)
    }
}

impl Qoi for ForceAt {
    fn name(&self) -> Cow<'static, str> {
        format!("force-at-{}-mm", self.displacement_mm()).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("force_at_{}_mm_N", self.displacement_mm()).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("force at {} mm", self.displacement_mm()).into()
    }

    fn unit(&self) -> Unit {
        Unit::N
    }

    fn extent(&self) -> Extent {
        Extent::Displacement(self.displacement_mm())
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        self.read(curve, &curve.curve().force_n)
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.read(curve, rates.force_n)
    }
}
