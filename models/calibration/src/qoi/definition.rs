//! The interface of a quantity of interest.

use std::borrow::Cow;
use std::fmt::Debug;

use super::curve::{CurveRates, PeakedCurve};
use super::error::QoiError;
use super::extent::Extent;
use super::unit::Unit;
use crate::experiment::TestCurve;

/// Step of the numerical derivative, as a fraction of the largest force.
const STEP: f64 = 1e-5;

/// A quantity of interest of a force–displacement curve, which a calibration can compare.
///
/// # Example
/// Displacement at which the force has fallen to 90 % of the peak:
/// ```
/// use std::borrow::Cow;
/// use breccia_calibration::{Extent, PeakedCurve, Qoi, QoiError, Qois, Quantity, TestCurve, Unit};
///
/// #[derive(Debug)]
/// struct DisplacementAtFall;
///
/// impl Qoi for DisplacementAtFall {
///     fn name(&self) -> Cow<'static, str> {
///         "displacement-at-fall".into()
///     }
///     fn column(&self) -> Cow<'static, str> {
///         "displacement_at_fall_mm".into()
///     }
///     fn description(&self) -> Cow<'static, str> {
///         "displacement at 10 % fall".into()
///     }
///     fn unit(&self) -> Unit {
///         Unit::MM
///     }
///     // viscous damage has fallen to 90 % of the peak at 1.26 times the displacement at peak
///     fn extent(&self) -> Extent {
///         Extent::Fraction(1.3)
///     }
///     fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
///         let TestCurve { displacement_mm: u, force_n: f, .. } = curve.curve();
///         let level = 0.9 * curve.peak_force_n();
///         let fallen = (1..u.len()).find(|&i| u[i] > curve.peak_mm() && f[i] < level);
///         let i = fallen.ok_or_else(|| self.not_reached(curve, 1.3 * curve.peak_mm()))?;
///         Ok(u[i - 1] + (u[i] - u[i - 1]) * (f[i - 1] - level) / (f[i - 1] - f[i]))
///     }
/// }
///
/// let displacement_mm: Vec<f64> = (0..=40).map(|i| 0.005 * i as f64).collect();
/// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
/// let curve = TestCurve::new(displacement_mm, force_n);
/// let values = Qois::values_of(&curve, 0.3, &[Quantity::new(DisplacementAtFall)])?;
/// assert!((values[0] - 0.1 * (1.0 + 0.1_f64.sqrt())).abs() < 2e-4);
/// # Ok::<(), QoiError>(())
/// ```
pub trait Qoi: Debug + Send + Sync + 'static {
    /// Name in a case file: words in lower case, joined by hyphens, as in `peak-force`.
    fn name(&self) -> Cow<'static, str>;

    /// Name with unit for the columns of tables and the outputs of surrogates, as in `peak_force_N`.
    fn column(&self) -> Cow<'static, str>;

    /// Name in figures and tables of the report, without unit, as in `peak force`.
    fn description(&self) -> Cow<'static, str>;

    fn unit(&self) -> Unit;

    /// Whether the quantity is positive for every curve with a peak. If so, a table with a value that is not
    /// positive is rejected.
    fn is_positive(&self) -> bool {
        true
    }

    /// Whether the quantity is computed from a curve. All other quantities are read from columns of
    /// tables.
    fn is_of_curve(&self) -> bool {
        true
    }

    /// Returns the part of the curve from which the quantity is computed.
    fn extent(&self) -> Extent {
        Extent::ToPeak
    }

    /// Whether the quantity is computed from the peak. All other quantities can also be computed from a curve without
    /// peak, such as the curve of a test that ends with a hold.
    fn needs_peak(&self) -> bool {
        true
    }

    /// Whether the quantity is computed from the times of the readings.
    fn needs_time(&self) -> bool {
        false
    }

    /// Computes the quantity of a curve, in the unit [`Qoi::unit`].
    ///
    /// # Errors
    /// If the quantity cannot be computed from the curve, see [`QoiError`].
    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError>;

    /// Computes the derivative of the quantity with respect to a parameter from the derivatives of the curve.
    ///
    /// The default is [`shifted_rate`](Self::shifted_rate).
    ///
    /// # Errors
    /// The errors of [`Qoi::value`].
    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        self.shifted_rate(curve, rates)
    }

    /// Computes the derivative of the quantity with respect to a parameter by a central difference of [`Qoi::value`]
    /// for curves with shifted forces and displacements. The step is 1e-5 times the largest force or the largest
    /// displacement, and the error is of second order in the step.
    ///
    /// # Errors
    /// The errors of [`Qoi::value`].
    fn shifted_rate(
        &self,
        curve: &PeakedCurve<'_>,
        rates: &CurveRates<'_>,
    ) -> Result<f64, QoiError> {
        let record = curve.record();
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let changes = [
            largest(rates.record_n) / largest(&record.force_n),
            largest(rates.record_mm) / largest(&record.displacement_mm),
        ];
        let fastest = changes.into_iter().filter(|change| change.is_finite()).fold(0.0, f64::max);
        if fastest == 0.0 {
            return Ok(0.0);
        }
        let step = STEP / fastest;
        let shifted = |side: f64| {
            let moved = |values: &[f64], rates: &[f64]| -> Vec<f64> {
                if rates.is_empty() {
                    return values.to_vec();
                }
                values.iter().zip(rates).map(|(value, rate)| value + side * step * rate).collect()
            };
            let shifted = TestCurve {
                force_n: moved(&record.force_n, rates.record_n),
                displacement_mm: moved(&record.displacement_mm, rates.record_mm),
                ..record.clone()
            };
            let shifted = PeakedCurve::with_any_peak(&shifted, curve.slope_fraction())?;
            if self.needs_peak() {
                shifted.check_peak()?;
            }
            self.value(&shifted)
        };
        Ok((shifted(1.0)? - shifted(-1.0)?) / (2.0 * step))
    }

    /// Estimates the quantity of a homogeneous cylinder; `None` if there is no closed form. The estimate reveals wrong
    /// units before any simulation.
    fn of_cylinder(&self, cylinder: &HomogeneousCylinder) -> Option<f64> {
        let _ = cylinder;
        None
    }

    /// Creates the error of a curve that has no readings at the displacement `needed_mm`.
    fn not_reached(&self, curve: &PeakedCurve<'_>, needed_mm: f64) -> QoiError {
        let displacements = curve.curve().displacement_mm.iter().copied();
        QoiError::NotReached {
            quantity: self.name().into_owned(),
            extent: self.extent(),
            needed_mm,
            from_mm: displacements.clone().fold(f64::INFINITY, f64::min),
            to_mm: displacements.fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// A homogeneous cylinder between sliding platens.
#[derive(Clone, Copy, Debug)]
pub struct HomogeneousCylinder {
    pub height_mm: f64,
    pub area_mm2: f64,
    pub young_mpa: f64,
    /// Strain and stress (MPa) at the peak; `None` for an elastic cylinder.
    pub peak: Option<[f64; 2]>,
}
