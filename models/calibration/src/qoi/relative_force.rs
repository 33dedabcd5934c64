//! Shape of a curve: its forces divided by the peak force.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;

/// Force at a percentage of the displacement at peak, divided by the peak force.
#[derive(Clone, Copy, Debug)]
pub struct RelativeForce {
    percent: u8,
}

impl RelativeForce {
    /// Largest percentage.
    pub const LARGEST_PERCENT: u8 = 199;

    /// Creates the quantity for a percentage from 1 to 199; `None` for others.
    pub fn new(percent: u8) -> Option<Self> {
        (1..=Self::LARGEST_PERCENT).contains(&percent).then_some(Self { percent })
    }

    /// Parses the name in a case, as in `force-at-50-percent`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Self::new(name.strip_prefix("force-at-")?.strip_suffix("-percent")?.parse().ok()?)
    }

    /// Parses the column of a table, as in `relative_force_at_50_percent`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        let percent = column.strip_prefix("relative_force_at_")?.strip_suffix("_percent")?;
        Self::new(percent.parse().ok()?)
    }

    /// Displacement divided by the displacement at peak.
    fn fraction(self) -> f64 {
        0.01 * f64::from(self.percent)
    }

    /// Reads `values` at the points of the curve, at the displacement of this quantity.
    fn read(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<Reading, QoiError> {
        let (at_mm, half_mm) = (self.fraction() * curve.peak_mm(), HALF_WIDTH * curve.peak_mm());
        let reading = Reading::of(&curve.curve().displacement_mm, values, at_mm, half_mm);
        reading.ok_or_else(|| self.not_reached(curve, at_mm))
    }
}

impl Qoi for RelativeForce {
    fn name(&self) -> Cow<'static, str> {
        format!("force-at-{}-percent", self.percent).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("relative_force_at_{}_percent", self.percent).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("force at {} % of the displacement at peak / peak force", self.percent).into()
    }

    fn unit(&self) -> Unit {
        Unit::ONE
    }

    fn extent(&self) -> Extent {
        Extent::Fraction(self.fraction())
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Ok(self.read(curve, &curve.curve().force_n)?.value / curve.peak_force_n())
    }

    /// The displacement at which the force is read moves with the displacement at peak.
    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        let force = self.read(curve, &curve.curve().force_n)?;
        let fixed = self.read(curve, rates.force_n)?.value;
        let by_displacement = self.fraction() * rates.peak_mm * force.slope;
        let by_peak_force = force.value / curve.peak_force_n() * rates.peak_force_n;
        Ok((fixed + by_displacement - by_peak_force) / curve.peak_force_n())
    }
}
