//! Relaxed fraction of the force during a hold.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;
use crate::branch::BranchKind;

/// Relaxed fraction of the force during the longest hold: 1 − F(end)/F(start).
///
/// F(start) is the first reading of the hold. F(end) is read at the last time of the hold from a parabola in time
/// through the last tenth of the hold. Holds before the first loading do not count. Of several holds with the longest
/// duration, the first one counts.
#[derive(Clone, Copy, Debug)]
pub struct RelaxedFraction;

impl RelaxedFraction {
    /// Reads `values` of the record at the start and the end of the longest hold.
    fn ends(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<[f64; 2], QoiError> {
        let times = &curve.record().time_s;
        let no_hold = || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "hold" };
        let hold = curve.longest(BranchKind::Hold).ok_or_else(no_hold)?;
        let duration_s = times[hold.readings.end - 1] - times[hold.readings.start];
        let readings = hold.readings.clone();
        let end_s = times[readings.end - 1];
        let half_s = HALF_WIDTH * duration_s;
        let end = Reading::of(&times[readings.clone()], &values[readings.clone()], end_s, half_s);
        Ok([values[readings.start], end.ok_or_else(no_hold)?.value])
    }
}

impl Qoi for RelaxedFraction {
    fn name(&self) -> Cow<'static, str> {
        "relaxed-fraction".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "relaxed_fraction".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "relaxed fraction".into()
    }

    fn unit(&self) -> Unit {
        Unit::ONE
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn extent(&self) -> Extent {
        Extent::Hold
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn needs_time(&self) -> bool {
        true
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        let [start, end] = self.ends(curve, &curve.record().force_n)?;
        Ok(1.0 - end / start)
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        let [start, end] = self.ends(curve, &curve.record().force_n)?;
        let [start_rate, end_rate] = self.ends(curve, rates.record_n)?;
        Ok((end * start_rate / start - end_rate) / start)
    }
}
