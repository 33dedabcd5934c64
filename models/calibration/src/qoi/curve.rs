//! A curve with its peak, from which quantities of interest are computed.

use std::borrow::Cow;

use super::error::QoiError;
use super::peak::Peak;
use crate::branch::{Branch, BranchKind};
use crate::experiment::TestCurve;

/// Fewest points of a curve.
const FEWEST_POINTS: usize = 5;

/// A curve with its peak.
///
/// The peak belongs to the first loading: with a load program, readings of hold, unloading and reloading do not
/// count. For a curve without noise, the peak is the vertex of the least-squares parabola through the readings around
/// the highest reading whose force is at least 97 % of the highest force, including at least the two neighbours of
/// the highest reading; from nine such readings on, the peak is the maximum of a cubic. For a noisy curve, the peak
/// is the maximum of a polynomial that is fitted within a window of displacement around the peak. Width of the window
/// and degree of the polynomial have the smallest expected error for the noise and the number of readings.
#[derive(Debug)]
pub struct PeakedCurve<'a> {
    record: &'a TestCurve,
    /// First loading of the record.
    loading: Cow<'a, TestCurve>,
    /// Indices of the readings of the first loading; `None` for all readings.
    chosen: Option<Vec<usize>>,
    /// The peak, or the reason why the first loading has no peak.
    peak: Result<Peak, QoiError>,
    slope_fraction: f64,
}

impl<'a> PeakedCurve<'a> {
    /// Locates the peak of a curve. `slope_fraction` is the displacement at which the slope of the rising branch is
    /// taken, divided by the displacement at peak.
    ///
    /// # Errors
    /// If the numbers of forces and displacements differ, or the curve has fewer than 5 points or no peak.
    pub fn new(curve: &'a TestCurve, slope_fraction: f64) -> Result<Self, QoiError> {
        let curve = Self::with_any_peak(curve, slope_fraction)?;
        curve.check_peak()?;
        Ok(curve)
    }

    /// Creates a curve like [`PeakedCurve::new`], but the curve need not have a peak, as in a test that
    /// ends with a hold.
    ///
    /// # Errors
    /// If the numbers of forces and displacements differ, or the curve has fewer than 5 points.
    pub fn with_any_peak(record: &'a TestCurve, slope_fraction: f64) -> Result<Self, QoiError> {
        let (u, force) = (&record.displacement_mm, &record.force_n);
        if u.len() != force.len() {
            return Err(unequal(u, "forces", force));
        }
        if u.len() < FEWEST_POINTS {
            return Err(QoiError::TooShort { points: u.len() });
        }
        let chosen = record.first_loading();
        let loading = match &chosen {
            Some(chosen) => Cow::Owned(record.picked(chosen)),
            None => Cow::Borrowed(record),
        };
        let points = loading.displacement_mm.len();
        let peak = match points < FEWEST_POINTS {
            true => Err(QoiError::TooShort { points }),
            false => Peak::of(&loading.displacement_mm, &loading.force_n),
        };
        Ok(Self { record, loading, chosen, peak, slope_fraction })
    }

    /// Returns the reason why the curve has no peak as an error.
    pub(super) fn check_peak(&self) -> Result<(), QoiError> {
        self.peak.as_ref().map(|_| ()).map_err(QoiError::clone)
    }

    /// The readings of the first loading: all readings of a test without hold and unloading.
    pub fn curve(&self) -> &TestCurve {
        &self.loading
    }

    /// Returns all readings, including hold, unloading and reloading.
    pub fn record(&self) -> &'a TestCurve {
        self.record
    }

    /// Values at the readings of [`record`](Self::record), reduced to the readings of [`curve`](Self::curve).
    pub fn on_loading<'b>(&self, values: &'b [f64]) -> Cow<'b, [f64]> {
        match &self.chosen {
            Some(chosen) => chosen.iter().map(|&i| values[i]).collect(),
            None => Cow::Borrowed(values),
        }
    }

    /// Returns the branches of a kind, in the order of time, without branches before the first
    /// loading.
    pub(super) fn branches(&self, kind: BranchKind) -> impl Iterator<Item = &Branch> {
        let all = self.record.branches.iter();
        all.skip_while(|branch| branch.kind != BranchKind::Loading).filter(move |b| b.kind == kind)
    }

    /// Returns the longest branch of a kind, without branches before the first loading. Of several longest branches, the
    /// first one is returned.
    pub(super) fn longest(&self, kind: BranchKind) -> Option<&Branch> {
        let times = &self.record.time_s;
        let duration_s =
            |branch: &Branch| times[branch.readings.end - 1] - times[branch.readings.start];
        let mut longest: Option<&Branch> = None;
        for branch in self.branches(kind) {
            // with the tolerance, a rounding error does not decide which of two branches is the longest
            if longest.is_none_or(|most| duration_s(branch) > duration_s(most) * (1.0 + 1e-9)) {
                longest = Some(branch);
            }
        }
        longest
    }

    /// Displacement at the peak force, mm; NaN if a curve of [`with_any_peak`](Self::with_any_peak) has no peak.
    pub fn peak_mm(&self) -> f64 {
        self.peak.as_ref().map_or(f64::NAN, |peak| peak.at_mm)
    }

    /// Peak force, N; NaN if a curve of [`with_any_peak`](Self::with_any_peak) has no peak.
    pub fn peak_force_n(&self) -> f64 {
        self.peak.as_ref().map_or(f64::NAN, |peak| peak.force_n)
    }

    /// Displacement at which the slope of the rising branch is taken, divided by the displacement at peak.
    pub fn slope_fraction(&self) -> f64 {
        self.slope_fraction
    }

    /// Completes the derivatives of the forces (N per unit of a parameter, one per reading) by the derivatives of the
    /// peak. The readings to which the peak is fitted do not change. `record_n` has a derivative for each reading of
    /// [`record`](Self::record); `force_n` has the derivatives of the readings [on the first
    /// loading](Self::on_loading).
    ///
    /// # Errors
    /// [`QoiError::UnequalLengths`] if the numbers of derivatives and readings differ.
    pub fn rates<'b>(
        &self,
        force_n: &'b [f64],
        record_n: &'b [f64],
    ) -> Result<CurveRates<'b>, QoiError> {
        let (u, force) = (&self.loading.displacement_mm, &self.loading.force_n);
        for (displacements, rates) in [(u, force_n), (&self.record.displacement_mm, record_n)] {
            if rates.len() != displacements.len() {
                return Err(unequal(displacements, "derivatives of the force", rates));
            }
        }
        let rates = self.peak.as_ref().map(|peak| peak.rates(u, force, force_n));
        let [peak_mm, peak_force_n] = rates.unwrap_or([f64::NAN; 2]);
        Ok(CurveRates { force_n, record_n, record_mm: &[], peak_mm, peak_force_n })
    }
}

/// Error of a curve whose displacements and other values differ in number.
fn unequal(displacement_mm: &[f64], name: &'static str, values: &[f64]) -> QoiError {
    let (displacements, values) = (displacement_mm.len(), values.len());
    QoiError::UnequalLengths { displacements, name, values }
}

/// Derivatives of a curve and its peak with respect to a parameter. The displacements of the readings are fixed, except
/// for [`record_mm`](Self::record_mm).
#[derive(Clone, Copy, Debug)]
pub struct CurveRates<'a> {
    /// Derivative of each force of [`PeakedCurve::curve`], N per unit of the parameter.
    pub force_n: &'a [f64],
    /// Derivative of each force of [`PeakedCurve::record`], N per unit of the parameter.
    pub record_n: &'a [f64],
    /// Derivative of each displacement of [`PeakedCurve::record`], mm per unit of the parameter, if the machine controls
    /// the force; empty if the displacements are fixed. [`Qois::rates_of`](crate::Qois::rates_of) then takes the derivatives of all
    /// quantities from [`Qoi::shifted_rate`](crate::Qoi::shifted_rate).
    pub record_mm: &'a [f64],
    /// Derivative of the displacement at peak, mm per unit of the parameter.
    pub peak_mm: f64,
    /// Derivative of the peak force, N per unit of the parameter.
    pub peak_force_n: f64,
}
