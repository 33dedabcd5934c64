//! Relaxed fraction of the force during a hold.

use std::borrow::Cow;

use super::branch_number::BranchNumber;
use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;
use crate::branch::BranchKind;

/// Relaxed fraction of the force during a hold, by default during the longest hold: 1 − F(end)/F(start).
///
/// F(start) is the first reading of the hold. F(end) is read at the last time of the hold from a parabola in time
/// through the last tenth of the hold. Holds before the first loading do not count. Of several holds with the longest
/// duration, the first one counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct RelaxedFraction {
    /// The hold; `None` for the longest hold.
    hold: Option<BranchNumber>,
}

impl RelaxedFraction {
    /// Creates the relaxed fraction of the hold with this number, from 1 to 1000.
    pub fn of_hold(number: u32) -> Option<Self> {
        BranchNumber::new(number).map(|hold| Self { hold: Some(hold) })
    }

    /// Parses the name in a case, as in `relaxed-fraction-2`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        BranchNumber::between(name, "relaxed-fraction-", "").map(|hold| Self { hold: Some(hold) })
    }

    /// Parses the column of a table, as in `relaxed_fraction_2`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        BranchNumber::between(column, "relaxed_fraction_", "").map(|hold| Self { hold: Some(hold) })
    }

    /// The number of the hold behind `joint`; nothing for the longest hold.
    fn suffix(self, joint: char) -> String {
        self.hold.map(|hold| format!("{joint}{}", hold.get())).unwrap_or_default()
    }

    /// Reads `values` of the record at the start and the end of the hold.
    fn ends(&self, curve: &PeakedCurve<'_>, values: &[f64]) -> Result<[f64; 2], QoiError> {
        let times = &curve.record().time_s;
        let no_hold = || QoiError::NoBranch { quantity: self.name().into_owned(), branch: "hold" };
        let hold = match self.hold {
            Some(number) => curve.branches(BranchKind::Hold).nth(number.earlier()),
            None => curve.longest(BranchKind::Hold),
        };
        let hold = hold.ok_or_else(no_hold)?;
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
        format!("relaxed-fraction{}", self.suffix('-')).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("relaxed_fraction{}", self.suffix('_')).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("relaxed fraction{}", self.suffix(' ')).into()
    }

    fn unit(&self) -> Unit {
        Unit::ONE
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn extent(&self) -> Extent {
        Extent::Hold(self.hold.unwrap_or(BranchNumber::FIRST).get())
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
