//! Quantities of interest of a force–displacement curve: slopes before and past its peak, peak force, displacement
//! at peak, energy up to the peak, forces at displacements, and the shape of the curve.

mod error;
mod fits;
mod line;
pub mod noise;
mod peak;
mod peak_window;
mod place;
mod quantity;
mod rates;

use crate::experiment::TestCurve;
pub use error::QoiError;
pub use line::{Line, Window};
use peak::Peak;
use place::Place;
pub use quantity::Quantity;

/// Quantities of interest of one curve: peak, slope of the rising branch, and work up to the peak.
///
/// - peak (F, d_F): for a curve without noise, the vertex of the least-squares parabola through the readings around the
///   highest one whose force is at least 97 % of the highest force, including at least the two neighbours of the
///   highest reading; for a noisy curve, the maximum of a polynomial that is fitted within a window of displacement
///   around the peak. Width of the window and degree of the polynomial have the smallest expected error for the noise
///   and the number of readings;
/// - slope m: slope of the least-squares line through the curve, taken as linear between its readings, at displacements
///   d with |d − f·d_F| ≤ 0.1 d_F, where f is the slope fraction. The fit is to the curve and not to the single
///   readings, so that m is a smooth function of d_F. For dense readings, m is the slope of the line through the
///   readings;
/// - work W = ∫ F du up to (d_F, F), by the trapezoidal rule.
///
/// # Example
/// ```
/// use breccia_calibration::{TestCurve, Qois};
/// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
/// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
/// let qois = Qois::of(&TestCurve { displacement_mm, force_n }, 0.3)?;
/// assert!((qois.peak_force_n - 100.0).abs() < 1e-9);
/// assert!((qois.displacement_at_peak_mm - 0.1).abs() < 1e-9);
/// assert!((qois.slope_n_per_mm - 1400.0).abs() < 1e-6);      // derivative at 0.03 mm
/// # Ok::<(), breccia_calibration::QoiError>(())
/// ```
///
/// # References
/// In the paper, section "Quantities of Interest", the slope is taken at 0.3 d_F for simulations and five tests and at
/// 0.55 d_F for seven tests, and the peak is the highest recorded point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Qois {
    /// Slope of the rising branch in N/mm.
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
        let (u, force) = (&curve.displacement_mm, &curve.force_n);
        if u.len() < 5 || u.len() != force.len() {
            return Err(QoiError::TooShort { points: u.len().min(force.len()) });
        }
        let Peak { at_mm: displacement_at_peak_mm, force_n: peak_force_n, .. } =
            Peak::of(u, force)?;
        let window = Window::around(slope_fraction, displacement_at_peak_mm);
        let slope_n_per_mm = slope_line(curve, window)?.slope;
        let energy_to_peak_n_mm = work(u, force, (displacement_at_peak_mm, peak_force_n));
        Ok(Self { slope_n_per_mm, peak_force_n, displacement_at_peak_mm, energy_to_peak_n_mm })
    }

    /// Computes the given quantities of a curve, in the given order.
    ///
    /// # Errors
    /// As [`Qois::of`], and [`QoiError::NotReached`] if the curve does not include the displacement of a quantity.
    ///
    /// # Example
    /// F = 2000 u − 10 000 u² falls by 2 · 10 000 · (1.2 − 1) · 0.1 mm = 400 N/mm past its peak at 0.1 mm:
    /// ```
    /// use breccia_calibration::{Qois, Quantity, TestCurve};
    /// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
    /// let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
    /// let curve = TestCurve { displacement_mm, force_n };
    /// let quantities = [Quantity::PostPeakSlope, Quantity::ForceAt(50)];   // at 0.05 mm
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
        let own = Self::of(curve, slope_fraction)?;
        let peak_mm = own.displacement_at_peak_mm;
        let value = |&quantity: &Quantity| match quantity {
            Quantity::Slope => Ok(own.slope_n_per_mm),
            Quantity::PeakForce => Ok(own.peak_force_n),
            Quantity::DisplacementAtPeak => Ok(peak_mm),
            Quantity::EnergyToPeak => Ok(own.energy_to_peak_n_mm),
            Quantity::PostPeakSlope => Ok(post_peak_line(curve, peak_mm)?.slope),
            Quantity::RelativeForce(percent) => {
                let force = Place::of_the_peak(percent, peak_mm).read(curve, &curve.force_n)?.force;
                Ok(force / own.peak_force_n)
            }
            Quantity::ForceAt(place_um) => {
                Ok(Place::fixed(place_um).read(curve, &curve.force_n)?.force)
            }
        };
        quantities.iter().map(value).collect()
    }
}

/// Fits the least-squares line to the curve within `window`.
///
/// # Errors
/// If the window contains no reading, so that the line would be the chord between two readings outside, or if the
/// readings cover less than half of the window.
pub fn slope_line(curve: &TestCurve, window: Window) -> Result<Line, QoiError> {
    let line = Line::of(&curve.displacement_mm, &curve.force_n, window);
    line.filter(|_| window.readings(&curve.displacement_mm) > 0).ok_or(QoiError::NoSlope {
        readings: window.readings(&curve.displacement_mm),
        from_mm: window.from_mm,
        to_mm: window.to_mm,
    })
}

/// Fits the line whose slope is the slope past the peak.
///
/// # Errors
/// If the curve ends before the window does, or the window contains no reading.
fn post_peak_line(curve: &TestCurve, peak_mm: f64) -> Result<Line, QoiError> {
    let window = Window::around(Quantity::POST_PEAK, peak_mm);
    let ends =
        |fold: fn(f64, f64) -> f64, start| curve.displacement_mm.iter().copied().fold(start, fold);
    let to_mm = ends(f64::max, f64::NEG_INFINITY);
    if to_mm < window.to_mm * (1.0 - 1e-9) {
        return Err(QoiError::NotReached {
            quantity: Quantity::PostPeakSlope,
            place_mm: window.to_mm,
            from_mm: ends(f64::min, f64::INFINITY),
            to_mm,
        });
    }
    slope_line(curve, window)
}

/// ∫ F du from the first point to the peak, by the trapezoidal rule.
fn work(u: &[f64], force: &[f64], peak: (f64, f64)) -> f64 {
    let before = u.iter().copied().zip(force.iter().copied()).take_while(|(x, _)| *x < peak.0);
    let points: Vec<(f64, f64)> = before.chain([peak]).collect();
    points.windows(2).map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0)).sum()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn curve(step_mm: f64, n: usize, force: impl Fn(f64) -> f64) -> TestCurve {
        let displacement_mm: Vec<f64> = (0..=n).map(|i| step_mm * i as f64).collect();
        let force_n = displacement_mm.iter().map(|&u| force(u)).collect();
        TestCurve { displacement_mm, force_n }
    }

    /// F = A E ε exp(−(ε/ε_pk)³/3): the viscous limit of definitions 3.3, peak at ε_pk.
    fn viscous(u: f64) -> f64 {
        let (area, young, height, peak) = (19.6, 275.0, 4.4, 0.03);
        let strain = u / height;
        area * young * strain * (-(strain / peak).powi(3) / 3.0).exp()
    }

    #[test]
    fn a_parabola_is_recovered_wherever_its_points_lie() {
        for step in [0.013, 0.0057, 0.00031] {
            let n = (0.2 / step) as usize;
            let qois = Qois::of(&curve(step, n, |u| 147.0 - 2e4 * (u - 0.1217_f64).powi(2)), 0.3);
            let qois = qois.unwrap();
            assert_relative_eq!(qois.peak_force_n, 147.0, max_relative = 1e-11);
            assert_relative_eq!(qois.displacement_at_peak_mm, 0.1217, max_relative = 1e-9);
        }
    }

    #[test]
    fn the_peak_of_the_viscous_limit_is_located_far_below_the_load_step() {
        let exact = (0.132, viscous(0.132));
        for (step, n) in [(0.005, 36), (0.0047, 40), (0.001, 180)] {
            let qois = Qois::of(&curve(step, n, viscous), 0.3).unwrap();
            assert_relative_eq!(qois.displacement_at_peak_mm, exact.0, max_relative = 5e-3);
            assert_relative_eq!(qois.peak_force_n, exact.1, max_relative = 2e-3);
        }
    }

    #[test]
    fn the_slope_is_the_mean_derivative_at_the_chosen_fraction() {
        let curve = curve(0.0001, 2000, viscous);
        for fraction in [0.3, 0.55] {
            let qois = Qois::of(&curve, fraction).unwrap();
            let (d, h) = (qois.displacement_at_peak_mm, 1e-5);
            // a least-squares line over [c − w, c + w] has the slope 3/(2w³) ∫ (x − c) F dx
            let (c, w) = (fraction * d, 0.1 * d);
            let n = 20_000;
            let integral: f64 = (0..n)
                .map(|i| {
                    let x = -w + (i as f64 + 0.5) * 2.0 * w / n as f64;
                    x * viscous(c + x) * 2.0 * w / n as f64
                })
                .sum();
            assert_relative_eq!(
                qois.slope_n_per_mm,
                1.5 * integral / w.powi(3),
                max_relative = 1e-3
            );
            let derivative = (viscous(c + h) - viscous(c - h)) / (2.0 * h);
            assert_relative_eq!(qois.slope_n_per_mm, derivative, max_relative = 2e-2);
        }
    }

    #[test]
    fn quantities_follow_the_units_of_the_curve() {
        let base = curve(0.005, 36, viscous);
        let own = Qois::values_of(&base, 0.3, &Quantity::SCALARS).unwrap();
        let stretched = base.scale_displacement(1.1);
        let scaled = Qois::values_of(&stretched, 0.3, &Quantity::SCALARS).unwrap();
        let factors = [1.0 / 1.1, 1.0, 1.1, 1.1, 1.0 / 1.1];
        for ((own, scaled), factor) in own.iter().zip(&scaled).zip(factors) {
            assert_relative_eq!(*scaled, factor * own, max_relative = 1e-12);
        }
        // the force at a displacement that is stretched with the curve
        let force = |curve: &TestCurve, place_um| {
            Qois::values_of(curve, 0.3, &[Quantity::ForceAt(place_um)]).unwrap()[0]
        };
        assert_relative_eq!(force(&base, 50), force(&stretched, 55), max_relative = 1e-12);
    }

    /// The least-squares line through c (x − 1)² has the slope of the parabola in the middle of the window. If a curve
    /// ends before the window does, the error names quantity, displacement and remedy.
    #[test]
    fn the_slope_past_the_peak_is_that_of_the_falling_branch() {
        let parabola = |u: f64| 147.0 * (1.0 - (1.0 - u / 0.1217).powi(2));
        let slope = |curve: &TestCurve| Qois::values_of(curve, 0.3, &[Quantity::PostPeakSlope]);
        for (step, within) in [(0.0002, 1e-5), (0.005, 1e-2)] {
            let found = slope(&curve(step, (0.17 / step) as usize, parabola)).unwrap()[0];
            assert_relative_eq!(found, -147.0 * 0.4 / 0.1217, max_relative = within);
        }
        let error = slope(&curve(0.005, 31, parabola)).unwrap_err();
        assert!(matches!(error, QoiError::NotReached { to_mm: 0.155, .. }), "{error:?}");
        let message = error.to_string();
        for part in ["0.1582 mm", "130 %", "post-peak-slope", "test.stop_below_peak"] {
            assert!(message.contains(part), "{part}: {message}");
        }
    }

    #[test]
    fn measurement_noise_moves_the_peak_by_less_than_one_reading_would() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, Normal};
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
        let noise = Normal::new(0.0, 0.5).unwrap();
        let clean = Qois::of(&curve(0.005, 36, viscous), 0.3).unwrap();
        let mut squares = [0.0; 2];
        for _ in 0..400 {
            let mut noisy = curve(0.005, 36, viscous);
            noisy.force_n.iter_mut().for_each(|f| *f += noise.sample(&mut rng));
            let qois = Qois::of(&noisy, 0.3).unwrap();
            squares[0] += (qois.peak_force_n - clean.peak_force_n).powi(2) / 400.0;
            squares[1] +=
                (qois.displacement_at_peak_mm - clean.displacement_at_peak_mm).powi(2) / 400.0;
        }
        // the highest reading scatters by 0.5 N in force, and by more than the load step of 0.005 mm in displacement
        assert!(squares[0].sqrt() < 0.5, "{squares:?}");
        assert!(squares[1].sqrt() < 0.003, "{squares:?}");
    }

    #[test]
    fn curves_without_quantities_say_why() {
        let rising = Qois::of(&curve(0.005, 20, |u| 100.0 * u), 0.3).unwrap_err();
        assert!(matches!(rising, QoiError::NoPeak { end: "end", .. }), "{rising}");
        let falling = Qois::of(&curve(0.005, 20, |u| -100.0 * u), 0.3).unwrap_err();
        assert!(matches!(falling, QoiError::NoPeak { end: "start", .. }), "{falling}");
        let short = Qois::of(&curve(0.1, 2, viscous), 0.3).unwrap_err();
        assert_eq!(short, QoiError::TooShort { points: 3 });
        let coarse = Qois::of(&curve(0.044, 4, viscous), 0.45).unwrap_err();
        assert!(matches!(coarse, QoiError::NoSlope { readings: 0, .. }), "{coarse}");
    }

    /// ∫₀^d_F of the parabola F (1 − (1 − u/d_F)²) is ⅔ F d_F.
    #[test]
    fn the_work_of_a_parabola_is_two_thirds_of_its_rectangle() {
        let (peak, place) = (147.0, 0.1217);
        let parabola = |u: f64| peak * (1.0 - (1.0 - u / place).powi(2));
        let qois = Qois::of(&curve(0.0002, 900, parabola), 0.3).unwrap();
        let exact = 2.0 / 3.0 * peak * place;
        assert_relative_eq!(qois.energy_to_peak_n_mm, exact, max_relative = 1e-5);
    }
}
