//! Force or displacement at a fixed time.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::extent::Extent;
use super::reading::{HALF_WIDTH, Reading};
use super::unit::Unit;

/// Microseconds in a second.
const MICRO: f64 = 1e6;
/// Largest number of microseconds that a name can state: 115 days. Rounding errors of larger numbers are not small
/// against a microsecond.
const MOST_US: f64 = 1e13;

/// A time, counted from the first reading, at which a value is read.
///
/// The value is read from a parabola in time through the readings of the same branch. The window has a half width of a
/// tenth of the time since the start of the branch, and contains at least three readings.
#[derive(Clone, Copy, Debug)]
struct ReadingTime {
    /// Whole number of µs, so that names and columns are exact.
    time_us: u64,
}

impl ReadingTime {
    fn microseconds(time_us: u64) -> Option<Self> {
        (time_us > 0 && time_us as f64 <= MOST_US).then_some(Self { time_us })
    }

    /// Parses the number of s between `before` and `after`, which must be a whole number of µs.
    fn between(text: &str, before: &str, after: &str) -> Option<Self> {
        let number = text.strip_prefix(before)?.strip_suffix(after)?;
        let time_us = MICRO * number.parse::<f64>().ok()?;
        let whole = time_us.round();
        let is_whole = (1.0..=MOST_US).contains(&whole) && (time_us - whole).abs() < 1e-2;
        is_whole.then_some(Self { time_us: whole as u64 })
    }

    fn seconds(self) -> f64 {
        self.time_us as f64 / MICRO
    }

    /// Reads `values` at the readings of the record.
    fn read(
        self,
        quantity: &dyn Qoi,
        curve: &PeakedCurve<'_>,
        values: &[f64],
    ) -> Result<f64, QoiError> {
        let record = curve.record();
        let [Some(&from_s), Some(&to_s)] = [record.time_s.first(), record.time_s.last()] else {
            return Err(QoiError::NoTime { quantity: quantity.name().into_owned() });
        };
        let at_s = self.seconds();
        let holds = |readings: &std::ops::Range<usize>| {
            record.time_s[readings.end - 1] >= at_s * (1.0 - 1e-9)
        };
        let mut branches = record.branches.iter().map(|branch| branch.readings.clone());
        let readings = branches.find(holds).unwrap_or(0..record.time_s.len());
        let (times, values) = (&record.time_s[readings.clone()], &values[readings]);
        let half_s = HALF_WIDTH * (at_s - times[0]);
        let reading = Reading::of(times, values, at_s, half_s);
        let reading = reading.filter(|_| from_s <= at_s && at_s <= to_s * (1.0 + 1e-9));
        let not_reached = || QoiError::TimeNotReached {
            quantity: quantity.name().into_owned(),
            needed_s: at_s,
            from_s,
            to_s,
        };
        Ok(reading.ok_or_else(not_reached)?.value)
    }
}

/// Force at a time, counted from the first reading.
///
/// The force is read from a parabola in time through the readings of the same branch. The window has a half width of a
/// tenth of the time since the start of the branch, and contains at least three readings. The value is linear in the
/// forces of the curve.
#[derive(Clone, Copy, Debug)]
pub struct ForceAtTime(ReadingTime);

impl ForceAtTime {
    /// Creates the quantity for a time of a positive whole number of µs.
    pub fn microseconds(time_us: u64) -> Option<Self> {
        ReadingTime::microseconds(time_us).map(Self)
    }

    /// Parses the name in a case, as in `force-at-10-s`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        ReadingTime::between(name, "force-at-", "-s").map(Self)
    }

    /// Parses the column of a table, as in `force_at_10_s_N`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        ReadingTime::between(column, "force_at_", "_s_N").map(Self)
    }
}

/// Displacement at a time, counted from the first reading, such as the displacement after 10 s of creep.
///
/// The displacement is read like the force of [`ForceAtTime`].
#[derive(Clone, Copy, Debug)]
pub struct DisplacementAtTime(ReadingTime);

impl DisplacementAtTime {
    /// Creates the quantity for a time of a positive whole number of µs.
    pub fn microseconds(time_us: u64) -> Option<Self> {
        ReadingTime::microseconds(time_us).map(Self)
    }

    /// Parses the name in a case, as in `displacement-at-10-s`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        ReadingTime::between(name, "displacement-at-", "-s").map(Self)
    }

    /// Parses the column of a table, as in `displacement_at_10_s_mm`.
    pub(super) fn of_column(column: &str) -> Option<Self> {
        ReadingTime::between(column, "displacement_at_", "_s_mm").map(Self)
    }
}

impl Qoi for DisplacementAtTime {
    fn name(&self) -> Cow<'static, str> {
        format!("displacement-at-{}-s", self.0.seconds()).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("displacement_at_{}_s_mm", self.0.seconds()).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("displacement at {} s", self.0.seconds()).into()
    }

    fn unit(&self) -> Unit {
        Unit::MM
    }

    fn extent(&self) -> Extent {
        Extent::Time(self.0.seconds())
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn needs_time(&self) -> bool {
        true
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        self.0.read(self, curve, &curve.record().displacement_mm)
    }
}

impl Qoi for ForceAtTime {
    fn name(&self) -> Cow<'static, str> {
        format!("force-at-{}-s", self.0.seconds()).into()
    }

    fn column(&self) -> Cow<'static, str> {
        format!("force_at_{}_s_N", self.0.seconds()).into()
    }

    fn description(&self) -> Cow<'static, str> {
        format!("force at {} s", self.0.seconds()).into()
    }

    fn unit(&self) -> Unit {
        Unit::N
    }

    fn extent(&self) -> Extent {
        Extent::Time(self.0.seconds())
    }

    fn needs_peak(&self) -> bool {
        false
    }

    fn needs_time(&self) -> bool {
        true
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        self.0.read(self, curve, &curve.record().force_n)
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.0.read(self, curve, rates.record_n)
    }
}
