//! A curve with its peak, from which quantities of interest are computed.

use super::error::QoiError;
use super::peak::Peak;
use crate::experiment::TestCurve;

/// Fewest points of a curve.
const FEWEST_POINTS: usize = 5;

/// A curve with its peak.
///
/// For a curve without noise, the peak is the vertex of the least-squares parabola through the readings around the
/// highest one whose force is at least 97 % of the highest force, including at least the two neighbours of the highest
/// reading; from nine such readings on it is the maximum of a cubic. For a noisy curve, it is the maximum of a polynomial that is fitted within a window of displacement around
/// the peak. Width of the window and degree of the polynomial have the smallest expected error for the noise and the
/// number of readings.
#[derive(Debug)]
pub struct PeakedCurve<'a> {
    curve: &'a TestCurve,
    peak: Peak,
    slope_fraction: f64,
}

impl<'a> PeakedCurve<'a> {
    /// Locates the peak of a curve. `slope_fraction` is the displacement at which the slope of the rising branch is
    /// taken, divided by the displacement at peak.
    ///
    /// # Errors
    /// If the curve has fewer than 5 points or no peak.
    pub fn new(curve: &'a TestCurve, slope_fraction: f64) -> Result<Self, QoiError> {
        let (u, force) = (&curve.displacement_mm, &curve.force_n);
        if u.len() < FEWEST_POINTS || u.len() != force.len() {
            return Err(QoiError::TooShort { points: u.len().min(force.len()) });
        }
        Ok(Self { curve, peak: Peak::of(u, force)?, slope_fraction })
    }

    /// The readings.
    pub fn curve(&self) -> &'a TestCurve {
        self.curve
    }

    /// Displacement at the peak force, mm.
    pub fn peak_mm(&self) -> f64 {
        self.peak.at_mm
    }

    /// Peak force, N.
    pub fn peak_force_n(&self) -> f64 {
        self.peak.force_n
    }

    /// Displacement at which the slope of the rising branch is taken, divided by the displacement at peak.
    pub fn slope_fraction(&self) -> f64 {
        self.slope_fraction
    }

    /// Completes the derivatives of the forces (N per unit of a parameter, one per reading) by those of the peak. The
    /// readings to which the peak is fitted do not change.
    ///
    /// # Errors
    /// [`QoiError::TooShort`] if the numbers of derivatives and readings differ.
    pub fn rates<'b>(&self, force_n: &'b [f64]) -> Result<CurveRates<'b>, QoiError> {
        let (u, force) = (&self.curve.displacement_mm, &self.curve.force_n);
        if force_n.len() != force.len() {
            return Err(QoiError::TooShort { points: force_n.len().min(force.len()) });
        }
        let [peak_mm, peak_force_n] = self.peak.rates(u, force, force_n);
        Ok(CurveRates { force_n, peak_mm, peak_force_n })
    }
}

/// Derivatives of a curve and its peak with respect to a parameter; the displacements of the readings are fixed.
#[derive(Clone, Copy, Debug)]
pub struct CurveRates<'a> {
    /// Derivative of each force, N per unit of the parameter.
    pub force_n: &'a [f64],
    /// Derivative of the displacement at peak, mm per unit of the parameter.
    pub peak_mm: f64,
    /// Derivative of the peak force, N per unit of the parameter.
    pub peak_force_n: f64,
}
