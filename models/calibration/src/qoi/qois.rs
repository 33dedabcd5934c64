//! Quantities of interest of one curve.

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::displacement_at_peak::DisplacementAtPeak;
use super::energy_to_peak::EnergyToPeak;
use super::error::QoiError;
use super::peak_force::PeakForce;
use super::quantity::Quantity;
use super::slope::Slope;
use crate::experiment::TestCurve;

/// Peak, slope of the rising branch, and work up to the peak of one curve.
///
/// # Example
/// ```
/// use breccia_calibration::{TestCurve, Qois};
/// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
/// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
/// let qois = Qois::of(&TestCurve::new(displacement_mm, force_n), 0.3)?;
/// assert!((qois.peak_force_n - 100.0).abs() < 1e-9);
/// assert!((qois.displacement_at_peak_mm - 0.1).abs() < 1e-9);
/// assert!((qois.slope_n_per_mm - 1400.0).abs() < 1e-6);      // derivative at 0.03 mm
/// # Ok::<(), breccia_calibration::QoiError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Qois {
    /// Slope of the rising branch in N/mm, see [`Slope`].
    pub slope_n_per_mm: f64,
    /// Peak force in N.
    pub peak_force_n: f64,
    /// Displacement at the peak force in mm.
    pub displacement_at_peak_mm: f64,
    /// Work of the force up to the peak in N mm.
    pub energy_to_peak_n_mm: f64,
}

impl Qois {
    /// Computes the quantities of a curve. The slope is taken around the displacement `slope_fraction` · d_F.
    ///
    /// # Errors
    /// If the curve is too short, has no peak, or has no reading in the window of the slope.
    pub fn of(curve: &TestCurve, slope_fraction: f64) -> Result<Self, QoiError> {
        let curve = PeakedCurve::new(curve, slope_fraction)?;
        Ok(Self {
            slope_n_per_mm: Slope.value(&curve)?,
            peak_force_n: PeakForce.value(&curve)?,
            displacement_at_peak_mm: DisplacementAtPeak.value(&curve)?,
            energy_to_peak_n_mm: EnergyToPeak.value(&curve)?,
        })
    }

    /// Computes the given quantities of a curve, in the given order.
    ///
    /// # Errors
    /// The errors of [`PeakedCurve::new`] and of [`Qoi::value`]. A curve without peak is an error only if a quantity
    /// needs the peak.
    ///
    /// # Example
    /// F = 2000 u − 10 000 u² falls by 2 · 10 000 · (1.2 − 1) · 0.1 mm = 400 N/mm past its peak at 0.1 mm:
    /// ```
    /// use breccia_calibration::{ForceAt, PostPeakSlope, Qois, Quantity, TestCurve};
    /// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
    /// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
    /// let curve = TestCurve::new(displacement_mm, force_n);
    /// let force = ForceAt::micrometres(50).expect("a positive displacement");
    /// let quantities = [Quantity::new(PostPeakSlope), Quantity::new(force)];
    /// let values = Qois::values_of(&curve, 0.3, &quantities)?;
    /// assert!((values[0] + 400.0).abs() < 1e-6);
    /// assert!((values[1] - 75.0).abs() < 1e-6);
    /// # Ok::<(), breccia_calibration::QoiError>(())
    /// ```
    pub fn values_of(
        curve: &TestCurve,
        slope_fraction: f64,
        quantities: &[Quantity],
    ) -> Result<Vec<f64>, QoiError> {
        let curve = of_quantities(curve, slope_fraction, quantities)?;
        quantities.iter().map(|quantity| quantity.value(&curve)).collect()
    }

    /// Computes each of the given quantities of a curve, in the given order. In contrast to [`values_of`](Self::values_of), a
    /// quantity that cannot be computed does not prevent the computation of the other quantities.
    ///
    /// # Example
    /// A curve that ends before its peak has a force at 0.05 mm and no peak force:
    /// ```
    /// use breccia_calibration::{ForceAt, PeakForce, Qois, Quantity, TestCurve};
    /// let displacement_mm: Vec<f64> = (0..=8).map(|i| 0.01 * i as f64).collect();
    /// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
    /// let curve = TestCurve::new(displacement_mm, force_n);
    /// let force = ForceAt::micrometres(50).expect("a positive displacement");
    /// let found = Qois::each_of(&curve, 0.3, &[Quantity::new(force), Quantity::new(PeakForce)]);
    /// assert!((found[0].as_ref().unwrap() - 75.0).abs() < 1e-6);
    /// assert!(found[1].as_ref().unwrap_err().to_string().starts_with("no peak"));
    /// ```
    pub fn each_of(
        curve: &TestCurve,
        slope_fraction: f64,
        quantities: &[Quantity],
    ) -> Vec<Result<f64, QoiError>> {
        let curve = match PeakedCurve::with_any_peak(curve, slope_fraction) {
            Ok(curve) => curve,
            Err(error) => return vec![Err(error); quantities.len()],
        };
        let value = |quantity: &Quantity| {
            if quantity.needs_peak() {
                curve.check_peak()?;
            }
            quantity.value(&curve)
        };
        quantities.iter().map(value).collect()
    }

    /// Computes the derivatives of the given quantities with respect to a parameter, by the chain rule from the
    /// derivatives of the force at each point, N per unit of the parameter.
    ///
    /// If the curve begins unloaded, the derivative of its first force is zero. The displacements of the points and
    /// the set of readings to which the peak is fitted are assumed constant. Windows that are centred at a fraction
    /// of the displacement at peak move with the peak.
    ///
    /// # Errors
    /// The errors of [`Qois::values_of`], and [`QoiError::TooShort`] if the numbers of derivatives and
    /// forces differ.
    ///
    /// # Example
    /// The peak force of F = θ (u − u²/0.2) is proportional to θ, and the displacement at peak does not depend on θ:
    /// ```
    /// use breccia_calibration::{Qois, Quantity, TestCurve};
    /// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
    /// let rates: Vec<f64> = displacement_mm.iter().map(|u| u - u * u / 0.2).collect();
    /// let force_n = rates.iter().map(|rate| 2000.0 * rate).collect();
    /// let curve = TestCurve::new(displacement_mm, force_n);
    /// let rates = Qois::rates_of(&curve, 0.3, &Quantity::of_the_paper(), &rates)?;
    /// assert!((rates[1] - 100.0 / 2000.0).abs() < 1e-12);
    /// assert!(rates[2].abs() < 1e-12);
    /// # Ok::<(), breccia_calibration::QoiError>(())
    /// ```
    pub fn rates_of(
        curve: &TestCurve,
        slope_fraction: f64,
        quantities: &[Quantity],
        force_rates: &[f64],
    ) -> Result<Vec<f64>, QoiError> {
        Self::rates_along(curve, slope_fraction, quantities, force_rates, &[])
    }

    /// Computes the derivatives as [`rates_of`](Self::rates_of), for a test in which the machine controls the force:
    /// `displacement_rates` are the derivatives of the displacement at each point, mm per unit of the parameter. They are
    /// zero if the slice is empty.
    ///
    /// # Errors
    /// The errors of [`rates_of`](Self::rates_of).
    pub fn rates_along(
        curve: &TestCurve,
        slope_fraction: f64,
        quantities: &[Quantity],
        force_rates: &[f64],
        displacement_rates: &[f64],
    ) -> Result<Vec<f64>, QoiError> {
        let curve = of_quantities(curve, slope_fraction, quantities)?;
        let readings = curve.record().force_n.len();
        if force_rates.len() != readings {
            let (name, values) = ("derivatives of the force", force_rates.len());
            return Err(QoiError::UnequalLengths { displacements: readings, name, values });
        }
        if !displacement_rates.is_empty() && displacement_rates.len() != readings {
            let (name, values) = ("derivatives of the displacement", displacement_rates.len());
            return Err(QoiError::UnequalLengths { displacements: readings, name, values });
        }
        let on_loading = curve.on_loading(force_rates);
        let rates = curve.rates(&on_loading, force_rates)?;
        let is_fixed = displacement_rates.iter().all(|rate| *rate == 0.0);
        let of_quantity = |quantity: &Quantity| match is_fixed {
            true => quantity.rate(&curve, &rates),
            false => quantity
                .shifted_rate(&curve, &CurveRates { record_mm: displacement_rates, ..rates }),
        };
        quantities.iter().map(of_quantity).collect()
    }
}

/// Locates the peak of a curve if one of the quantities needs it.
fn of_quantities<'a>(
    curve: &'a TestCurve,
    slope_fraction: f64,
    quantities: &[Quantity],
) -> Result<PeakedCurve<'a>, QoiError> {
    let curve = PeakedCurve::with_any_peak(curve, slope_fraction)?;
    if quantities.iter().any(|quantity| quantity.needs_peak()) {
        curve.check_peak()?;
    }
    Ok(curve)
}

#[cfg(test)]
mod tests;
