//! Derivatives of quantities of interest with respect to a parameter.

use super::line::{Line, Window};
use super::peak::Peak;
use super::place::Place;
use super::{QoiError, Qois, Quantity, post_peak_line, slope_line, work};
use crate::experiment::TestCurve;

impl Qois {
    /// Derivatives of the quantities with respect to a parameter, by the chain rule from the derivatives of the force
    /// at each point, N per unit of the parameter.
    ///
    /// If the curve begins unloaded, the derivative of its first force is zero. The displacements of the points and the
    /// set of readings to which the peak is fitted are kept. The window of the slope moves with the displacement at
    /// peak. If the window did not move, the slope of viscous damage (F ∝ v exp(−x³/3) with x = u/d_F, d_F ~ ξ^(1/3))
    /// would seem to grow like ξ^0.04, although it does not depend on the viscosity ξ.
    ///
    /// # Errors
    /// As [`Qois::of`], and [`QoiError::TooShort`] if the numbers of derivatives and forces differ.
    ///
    /// # Example
    /// The peak force of F = θ (u − u²/0.2) is proportional to θ, and the displacement at peak does not depend on θ:
    /// ```
    /// use breccia_calibration::{Qois, TestCurve};
    /// let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
    /// let rates: Vec<f64> = displacement_mm.iter().map(|u| u - u * u / 0.2).collect();
    /// let force_n = rates.iter().map(|rate| 2000.0 * rate).collect();
    /// let rates = Qois::rates(&TestCurve { displacement_mm, force_n }, 0.3, &rates)?;
    /// assert!((rates.peak_force_n - 100.0 / 2000.0).abs() < 1e-12);
    /// assert!(rates.displacement_at_peak_mm.abs() < 1e-12);
    /// # Ok::<(), breccia_calibration::QoiError>(())
    /// ```
    pub fn rates(
        curve: &TestCurve,
        slope_fraction: f64,
        force_rates: &[f64],
    ) -> Result<Self, QoiError> {
        let own = Self::of(curve, slope_fraction)?;
        let (u, force) = (&curve.displacement_mm, &curve.force_n);
        if force_rates.len() != force.len() {
            return Err(QoiError::TooShort { points: force_rates.len().min(force.len()) });
        }
        let at = own.displacement_at_peak_mm;
        let [shift, peak_force_n] = Peak::of(u, force)?.rates(u, force, force_rates);

        let line = slope_line(curve, Window::around(slope_fraction, at))?;
        let slope_n_per_mm = line_rate(curve, force_rates, slope_fraction, line, [at, shift]);

        let before = u.iter().zip(force).take_while(|(x, _)| **x < at).last();
        let end = before.map_or(0.0, |(_, last)| 0.5 * (last + own.peak_force_n));
        let energy_to_peak_n_mm = work(u, force_rates, (at, peak_force_n)) + end * shift;
        Ok(Self {
            slope_n_per_mm,
            peak_force_n,
            displacement_at_peak_mm: shift,
            energy_to_peak_n_mm,
        })
    }

    /// Derivatives of the given quantities, as [`Qois::rates`]. The points of the shape and the window of the falling
    /// branch move with the displacement at peak.
    ///
    /// # Errors
    /// As [`Qois::rates`] and [`Qois::values_of`].
    pub fn rates_of(
        curve: &TestCurve,
        slope_fraction: f64,
        quantities: &[Quantity],
        force_rates: &[f64],
    ) -> Result<Vec<f64>, QoiError> {
        let own = Self::of(curve, slope_fraction)?;
        let rates = Self::rates(curve, slope_fraction, force_rates)?;
        let peak = [own.displacement_at_peak_mm, rates.displacement_at_peak_mm];
        let of_shape = |percent: u8| {
            let place = Place::of_the_peak(percent, peak[0]);
            let force = place.read(curve, &curve.force_n)?;
            let fixed = place.read(curve, force_rates)?.force;
            let moved = 0.01 * f64::from(percent) * peak[1] * force.slope;
            let relative = force.force / own.peak_force_n;
            Ok((fixed + moved - relative * rates.peak_force_n) / own.peak_force_n)
        };
        let rate = |&quantity: &Quantity| match quantity {
            Quantity::Slope => Ok(rates.slope_n_per_mm),
            Quantity::PeakForce => Ok(rates.peak_force_n),
            Quantity::DisplacementAtPeak => Ok(rates.displacement_at_peak_mm),
            Quantity::EnergyToPeak => Ok(rates.energy_to_peak_n_mm),
            Quantity::PostPeakSlope => {
                let line = post_peak_line(curve, peak[0])?;
                Ok(line_rate(curve, force_rates, Quantity::POST_PEAK, line, peak))
            }
            Quantity::RelativeForce(percent) => of_shape(percent),
            Quantity::ForceAt(place_um) => {
                Ok(Place::fixed(place_um).read(curve, force_rates)?.force)
            }
        };
        quantities.iter().map(rate).collect()
    }
}

/// Derivative of the slope of a line whose window moves with the displacement at peak, `peak_mm`. The derivative of the
/// displacement at peak is `peak_rate`.
fn line_rate(
    curve: &TestCurve,
    force_rates: &[f64],
    fraction: f64,
    line: Line,
    [peak_mm, peak_rate]: [f64; 2],
) -> f64 {
    let ends = Window::parts(fraction).into_iter().zip(line.slope_by_ends);
    let by_window: f64 = ends.map(|(part, by)| part * by).sum();
    let window = Window::around(fraction, peak_mm);
    let fixed = Line::of(&curve.displacement_mm, force_rates, window);
    fixed.map_or(0.0, |line| line.slope) + by_window * peak_rate
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    /// F = A E ε exp(−(ε/ε_pk)³/3) with ε_pk = (ε̇ ξ/(2E))^(1/3), as a function of E and ξ.
    fn viscous(young: f64, viscosity: f64) -> TestCurve {
        let (area, height) = (19.6, 4.4);
        let peak = (0.05 * viscosity / (2.0 * young)).cbrt();
        let displacement_mm: Vec<f64> = (0..=60).map(|i| 0.003 * f64::from(i)).collect();
        let force = |u: &f64| {
            let strain = u / height;
            area * young * strain * (-(strain / peak).powi(3) / 3.0).exp()
        };
        TestCurve { force_n: displacement_mm.iter().map(force).collect(), displacement_mm }
    }

    #[test]
    fn quantities_are_differentiated_through() {
        let at = [275.0, 0.3];
        let shape = [30, 72, 110].map(Quantity::RelativeForce);
        let forces = [20, 123, 160].map(Quantity::ForceAt);
        let quantities = [&Quantity::SCALARS[..], &shape, &forces].concat();
        for k in 0..2 {
            for fraction in [0.3, 0.55] {
                let reach = 1e-5 * at[k];
                let [low, high] = [-1.0, 1.0].map(|side| {
                    let mut moved = at;
                    moved[k] += side * reach;
                    viscous(moved[0], moved[1])
                });
                let difference = |a: f64, b: f64| (b - a) / (2.0 * reach);
                let forces = low.force_n.iter().zip(&high.force_n);
                let force_rates: Vec<f64> = forces.map(|(a, b)| difference(*a, *b)).collect();
                let of = |curve: &TestCurve| Qois::values_of(curve, fraction, &quantities).unwrap();
                let middle = viscous(at[0], at[1]);
                let rates = Qois::rates_of(&middle, fraction, &quantities, &force_rates).unwrap();
                let exact = of(&low).into_iter().zip(of(&high)).map(|(a, b)| difference(a, b));
                let found = quantities.iter().zip(of(&middle)).zip(rates).zip(exact);
                for (((quantity, value), rate), exact) in found {
                    let shape = matches!(quantity, Quantity::RelativeForce(_));
                    // the shape of the viscous limit does not depend on the parameters, except through the positions of
                    // the points
                    assert!(shape || exact.abs() > 1e-6, "{quantity} does not depend on {k}");
                    // rounding error of a difference between nearly equal values
                    let rounding = 1e-9 * value.abs() / at[k];
                    assert_relative_eq!(rate, exact, max_relative = 1e-6, epsilon = rounding);
                }
            }
        }
    }

    /// Compares with the slope of the line through the exact curve within a window that moves with the peak.
    #[test]
    fn the_window_of_the_slope_follows_the_peak() {
        let (area, height, at) = (19.6, 4.4, [275.0, 0.3]);
        let strain_at_peak =
            |[young, viscosity]: [f64; 2]| (0.05 * viscosity / (2.0 * young)).cbrt();
        for fraction in [0.3, 0.55] {
            let slope = |at: [f64; 2]| {
                // on x = ε/ε_pk, by the midpoint rule
                let n = 4000;
                let sum: f64 = (0..n)
                    .map(|i| {
                        let from_centre = (f64::from(i) + 0.5) * 0.2 / f64::from(n) - 0.1;
                        let x = fraction + from_centre;
                        from_centre * x * (-x.powi(3) / 3.0).exp()
                    })
                    .sum();
                1500.0 * sum * 0.2 / f64::from(n) * area * at[0] / height
            };
            let peak = strain_at_peak(at) * height;
            let displacement_mm: Vec<f64> =
                (0..=300).map(|i| 0.005 * f64::from(i) * peak).collect();
            let force = |at: [f64; 2], u: &f64| {
                let x = u / height / strain_at_peak(at);
                area * at[0] * u / height * (-x.powi(3) / 3.0).exp()
            };
            let forces = |at| displacement_mm.iter().map(|u| force(at, u)).collect::<Vec<f64>>();
            let curve = TestCurve { displacement_mm: displacement_mm.clone(), force_n: forces(at) };
            for k in 0..2 {
                let reach = 1e-4 * at[k];
                let [low, high] = [-1.0, 1.0].map(|side| {
                    let mut moved = at;
                    moved[k] += side * reach;
                    moved
                });
                let exact = (slope(high) - slope(low)) / (2.0 * reach);
                let difference = |(a, b): (f64, f64)| (b - a) / (2.0 * reach);
                let rates: Vec<f64> =
                    forces(low).into_iter().zip(forces(high)).map(difference).collect();
                let found = Qois::rates(&curve, fraction, &rates).unwrap().slope_n_per_mm;
                // the error is relative to the slope divided by the parameter. With a fixed window, the derivative with
                // respect to the viscosity would have an error of 0.04 (fraction 0.3) or 0.26 (fraction 0.55). The
                // parabola does not locate the peak, and thus the window, exactly, which causes errors of 0.2 % and
                // 0.8 %
                let scale = slope(at) / at[k];
                assert!((found - exact).abs() < 1e-2 * scale, "{k}: {found} {exact} of {scale}");
            }
        }
    }

    #[test]
    fn each_force_needs_its_rate() {
        let curve = viscous(275.0, 0.3);
        let short = Qois::rates(&curve, 0.3, &curve.force_n[..7]).unwrap_err();
        assert_eq!(short, QoiError::TooShort { points: 7 });
    }
}
