//! Work of the force up to the peak.

use std::borrow::Cow;

use super::curve::{CurveRates, PeakedCurve};
use super::definition::Qoi;
use super::error::QoiError;
use super::unit::Unit;

/// Work of the force up to the peak, ∫ F du, by the trapezoidal rule.
#[derive(Clone, Copy, Debug)]
pub struct EnergyToPeak;

impl Qoi for EnergyToPeak {
    fn name(&self) -> Cow<'static, str> {
        "energy-to-peak".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "energy_to_peak_N_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "energy to the peak".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_MM
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        let peak = (curve.peak_mm(), curve.peak_force_n());
        Ok(work(&curve.curve().displacement_mm, &curve.curve().force_n, peak))
    }

    fn rate(&self, curve: &PeakedCurve<'_>, rates: &CurveRates<'_>) -> Result<f64, QoiError> {
        let (u, force) = (&curve.curve().displacement_mm, &curve.curve().force_n);
        let peak_mm = curve.peak_mm();
        let before = u.iter().zip(force).take_while(|(x, _)| **x < peak_mm).last();
        let mean_at_end = before.map_or(0.0, |(_, last)| 0.5 * (last + curve.peak_force_n()));
        let fixed_peak = work(u, rates.force_n, (peak_mm, rates.peak_force_n));
        Ok(fixed_peak + mean_at_end * rates.peak_mm)
    }
}

/// ∫ F du from the first point to the peak, by the trapezoidal rule.
fn work(u: &[f64], force: &[f64], peak: (f64, f64)) -> f64 {
    let before = u.iter().copied().zip(force.iter().copied()).take_while(|(x, _)| *x < peak.0);
    let curve_to_peak: Vec<(f64, f64)> = before.chain([peak]).collect();
    curve_to_peak.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum()
}
