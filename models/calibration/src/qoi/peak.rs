//! The peak of a curve: the maximum of a polynomial that is fitted to the readings around the peak.

use super::error::QoiError;
use super::fits::Polynomial;
use super::noise;
use super::peak_window::{Fit, best_fit};

/// Readings of at least this fraction of the highest force locate the peak of a curve without noise.
const TOP: f64 = 0.97;
/// Smallest number of readings near the peak to which a cubic is fitted instead of a parabola. From this
/// number on, the error from the asymmetry of the curve is larger than the error from the spacing of the readings.
const CUBIC_FROM: usize = 9;
/// Noise, as a fraction of the highest force, below which the curve counts as a curve without noise.
const NOISE_FREE: f64 = 2e-4;

/// A peak and the fit that locates it.
#[derive(Debug)]
pub(super) struct Peak {
    /// Displacement in mm.
    pub(super) at_mm: f64,
    pub(super) force_n: f64,
    /// Indices of the readings to which the polynomial is fitted.
    readings: Vec<usize>,
    /// Degree of the polynomial.
    degree: usize,
}

impl Peak {
    /// Locates the peak of a curve.
    ///
    /// Without noise (simulations), the peak is the vertex of the parabola through the contiguous readings around the
    /// highest reading whose force is at least 97 % of the highest force, including at least the two neighbours of
    /// the highest reading. From nine such readings on, the peak is the maximum of a cubic. With noise, the highest
    /// reading and the set of these readings are random. Therefore the readings within a window of displacement
    /// around the peak are fitted (see [`best_fit`]).
    ///
    /// # Errors
    /// If the highest reading is the first or the last, or no fit has a maximum among its readings.
    pub(super) fn of(u: &[f64], force: &[f64]) -> Result<Self, QoiError> {
        let last = force.len() - 1;
        let top = (0..=last).max_by(|&i, &j| force[i].total_cmp(&force[j])).unwrap_or(0);
        if top == 0 || top == last {
            let end = if top == 0 { "start" } else { "end" };
            return Err(QoiError::NoPeak { end, displacement_mm: u[top] });
        }
        let noise_n = noise_around(u, force, u[top]);
        let peak = if noise_n <= NOISE_FREE * force[top] {
            Self::of_top_readings(u, force, top)
        } else {
            best_fit(u, force, u[top], noise_n).map(|Fit { at_mm, force_n, readings, degree }| {
                Self { at_mm, force_n, readings, degree }
            })
        };
        peak.ok_or(QoiError::Unresolved { displacement_mm: u[top] })
    }

    fn of_top_readings(u: &[f64], force: &[f64], top: usize) -> Option<Self> {
        let high = |i: usize| force[i] >= TOP * force[top];
        let first = (0..top).rev().take_while(|&i| high(i)).last().unwrap_or(top - 1);
        let end = (top + 1..force.len()).take_while(|&i| high(i)).last().unwrap_or(top + 1);
        let shifted_readings: Vec<_> = (first..=end).map(|i| (u[i] - u[top], force[i])).collect();
        let ends = [shifted_readings[0].0, shifted_readings[shifted_readings.len() - 1].0];
        let fit = |degree: usize| {
            let polynomial = Polynomial::of(&shifted_readings, degree);
            polynomial.maximum(0.0, ends).map(|x| (polynomial, x))
        };
        let cubic = (shifted_readings.len() >= CUBIC_FROM).then(|| fit(3)).flatten();
        let (polynomial, x) = cubic.or_else(|| fit(2))?;
        Some(Self {
            at_mm: u[top] + x,
            force_n: polynomial.at(x),
            readings: (first..=end).collect(),
            degree: polynomial.degree(),
        })
    }

    /// Derivatives of displacement and force of the peak with respect to a parameter, from the derivatives of the
    /// force at each reading. The set of readings of the fit is assumed constant.
    pub(super) fn rates(&self, u: &[f64], force: &[f64], force_rates: &[f64]) -> [f64; 2] {
        let fit = |y: &[f64]| {
            let shifted_readings: Vec<_> =
                self.readings.iter().map(|&i| (u[i] - self.at_mm, y[i])).collect();
            Polynomial::of(&shifted_readings, self.degree).jet(0.0)
        };
        let (of_force, change) = (fit(force), fit(force_rates));
        // the slope is zero at the peak, so that the shift does not change the force
        [-change.slope / of_force.curvature, change.value]
    }
}

/// Noise of the force (N), from the readings whose distance to the peak is at most half of the displacement from start
/// to peak.
fn noise_around(u: &[f64], force: &[f64], peak_mm: f64) -> f64 {
    let start = u.iter().copied().fold(f64::INFINITY, f64::min);
    let reach = 0.5 * (peak_mm - start);
    let near = u.iter().zip(force).filter(|(u, _)| (*u - peak_mm).abs() <= reach);
    let (u, force): (Vec<f64>, Vec<f64>) = near.map(|(u, f)| (*u, *f)).unzip();
    noise::standard_deviation(&u, &force)
}
