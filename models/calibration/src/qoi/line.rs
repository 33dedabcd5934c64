//! Least-squares line through a curve within a window, where the curve is linear between its readings.

use super::error::QoiError;
use crate::experiment::TestCurve;

/// Half width of a window in units of the displacement at peak.
const HALF_WIDTH: f64 = 0.1;

/// Window of displacement (mm) in which a line is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    pub from_mm: f64,
    pub to_mm: f64,
}

impl Window {
    /// Creates the window around the displacement `fraction` · `peak_mm`. The width of the window is
    /// a fifth of `peak_mm`.
    pub fn around(fraction: f64, peak_mm: f64) -> Self {
        let [from_mm, to_mm] = Self::parts(fraction).map(|end| end * peak_mm);
        Self { from_mm, to_mm }
    }

    /// Returns the ends of the window around `fraction`, divided by the displacement at peak.
    pub fn parts(fraction: f64) -> [f64; 2] {
        [fraction - HALF_WIDTH, fraction + HALF_WIDTH]
    }

    /// Number of readings in the window.
    pub fn readings(self, u: &[f64]) -> usize {
        // a reading on the border belongs to the window in spite of rounding errors
        let slack = 1e-9 * (self.to_mm - self.from_mm);
        u.iter().filter(|u| (self.from_mm - slack..=self.to_mm + slack).contains(u)).count()
    }
}

/// Least-squares line through a curve y(u), u in mm, that is linear between its readings. Over a window of length L
/// with the midpoint c, the slope is 12/L³ ∫ (u − c) y du, and the line passes through the mean of y at c.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Slope in the unit of y per mm.
    pub slope: f64,
    /// Midpoint (mm) of the part of the window that the readings cover.
    pub middle_mm: f64,
    /// Mean of y over this part of the window.
    pub mean: f64,
    /// Derivatives of the slope with respect to the start and the end of the window.
    pub slope_by_ends: [f64; 2],
}

impl Line {
    /// Fits the line to values y at displacements u in mm. Readings may be in any order, because noise makes the
    /// displacement go back and forth. Readings at the same displacement are averaged. Returns `None` if the readings
    /// cover less than half of the window.
    pub fn of(u: &[f64], y: &[f64], window: Window) -> Option<Self> {
        let readings = distinct(u, y);
        let (first, last) = (readings.first()?.0, readings.last()?.0);
        let (from, to) = (window.from_mm.max(first), window.to_mm.min(last));
        let (length, middle_mm) = (to - from, 0.5 * (from + to));
        if !(length > 0.0 && length >= 0.5 * (window.to_mm - window.from_mm)) {
            return None;
        }
        let at = |x: f64| {
            let k = readings.partition_point(|p| p.0 < x).clamp(1, readings.len() - 1);
            let (a, b) = (readings[k - 1], readings[k]);
            a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)
        };
        let [start, end] = [from, to].map(|x| (x, at(x)));
        let inside = readings.iter().copied().filter(|p| from < p.0 && p.0 < to);
        let corners: Vec<_> = [start].into_iter().chain(inside).chain([end]).collect();
        let (mut area, mut moment) = (0.0, 0.0);
        for ends in corners.windows(2) {
            let (x, y) = ([ends[0].0 - middle_mm, ends[1].0 - middle_mm], [ends[0].1, ends[1].1]);
            let product_in_between = 0.25 * (x[0] + x[1]) * (y[0] + y[1]);
            area += 0.5 * (x[1] - x[0]) * (y[0] + y[1]);
            // Simpson's rule, exact for a product of two lines
            moment += (x[1] - x[0]) / 6.0 * (x[0] * y[0] + 4.0 * product_in_between + x[1] * y[1]);
        }
        let factor = 12.0 / length.powi(3);
        let (at_end, stretched) = (|y: f64| 0.5 * (length * y - area), 3.0 * moment / length);
        // if the window extends beyond the readings, the line ends at the outermost reading, which does not move
        let by_start = if window.from_mm < first { 0.0 } else { at_end(start.1) + stretched };
        let by_end = if window.to_mm > last { 0.0 } else { at_end(end.1) - stretched };
        Some(Self {
            slope: factor * moment,
            middle_mm,
            mean: area / length,
            slope_by_ends: [factor * by_start, factor * by_end],
        })
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

/// Sorts the readings by displacement and averages readings at the same displacement.
fn distinct(u: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let mut readings: Vec<(f64, f64)> = u.iter().copied().zip(y.iter().copied()).collect();
    readings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let same = readings.chunk_by(|a, b| a.0 == b.0);
    same.map(|same| (same[0].0, same.iter().map(|p| p.1).sum::<f64>() / same.len() as f64))
        .collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    const WINDOW: Window = Window { from_mm: 0.0237, to_mm: 0.0481 };

    fn readings(step_mm: f64) -> Vec<f64> {
        (0..).map(|i| step_mm * f64::from(i)).take_while(|u| *u < 0.2).collect()
    }

    /// Slope of the least-squares line through points.
    fn line_of_points(points: &[(f64, f64)]) -> f64 {
        let n = points.len() as f64;
        let centre = points.iter().map(|p| p.0).sum::<f64>() / n;
        let [xy, xx] = points.iter().fold([0.0; 2], |[xy, xx], (x, y)| {
            [xy + (x - centre) * y, xx + (x - centre) * (x - centre)]
        });
        xy / xx
    }

    #[test]
    fn a_line_is_recovered_wherever_its_readings_lie() {
        for step in [0.0001, 0.0046, 0.013, 0.05] {
            let u = readings(step);
            let y: Vec<f64> = u.iter().map(|u| 3.0 - 1200.0 * u).collect();
            let line = Line::of(&u, &y, WINDOW).unwrap();
            assert_relative_eq!(line.slope, -1200.0, max_relative = 1e-12);
            let mean = 3.0 - 1200.0 * line.middle_mm;
            assert_relative_eq!(line.mean, mean, max_relative = 1e-12);
            assert!(line.slope_by_ends.iter().all(|by| by.abs() < 1e-7), "{line:?}");
        }
    }

    /// The line through y = u² over [a, b] has the slope a + b, whose derivative with respect to each end is 1.
    #[test]
    fn the_line_through_a_parabola_has_the_slope_in_its_middle() {
        let u = readings(1e-5);
        let y: Vec<f64> = u.iter().map(|u| u * u).collect();
        let line = Line::of(&u, &y, WINDOW).unwrap();
        assert_relative_eq!(line.slope, WINDOW.from_mm + WINDOW.to_mm, max_relative = 1e-8);
        for by in line.slope_by_ends {
            assert_relative_eq!(by, 1.0, max_relative = 1e-3);
        }
    }

    /// Compares the derivatives with central differences, for ends of the window between readings and at readings.
    #[test]
    fn the_slope_is_smooth_in_the_ends_of_the_window() {
        let u = readings(0.0046);
        let y: Vec<f64> = u.iter().map(|u| (40.0 * u).sin()).collect();
        let reach = 1e-7;
        for shift in 0..200 {
            let shift = 1e-4 * f64::from(shift) + 3.3e-6;
            let window = |ends: [f64; 2]| Window {
                from_mm: WINDOW.from_mm + shift + ends[0],
                to_mm: WINDOW.to_mm + shift + ends[1],
            };
            let slope = |ends| Line::of(&u, &y, window(ends)).unwrap().slope;
            let computed = Line::of(&u, &y, window([0.0; 2])).unwrap().slope_by_ends;
            let exact = [[reach, 0.0], [0.0, reach]]
                .map(|e| (slope(e) - slope(e.map(|e| -e))) / (2.0 * reach));
            for (computed, exact) in computed.iter().zip(exact) {
                assert_relative_eq!(computed, &exact, max_relative = 1e-6, epsilon = 1e-5);
            }
        }
    }

    #[test]
    fn what_the_readings_do_not_cover_is_left_out() {
        let u: Vec<f64> = readings(0.001).into_iter().filter(|u| *u > 0.0305).collect();
        let y: Vec<f64> = u.iter().map(|u| u * u).collect();
        let line = Line::of(&u, &y, WINDOW).unwrap();
        assert_relative_eq!(line.slope, 0.031 + WINDOW.to_mm, max_relative = 1e-3);
        assert_eq!(line.slope_by_ends[0], 0.0);
        assert_eq!(Line::of(&u[10..], &y[10..], WINDOW), None);
        assert_eq!(Line::of(&[], &[], WINDOW), None);
    }

    /// A testing machine records ten readings per step of its displacement, or the displacement has noise; the force
    /// has noise, too. The difference from the slope of the line through the readings is compared with the standard
    /// error of that line, s √12/(L √n).
    #[test]
    fn dense_noisy_readings_have_the_slope_of_the_line_through_them() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let noise = Normal::new(0.0, 0.3).unwrap();
        let jitter = Normal::new(0.0, 2e-4).unwrap();
        for (step, resolution) in [(1e-5, 1e-4), (1e-5, 0.0), (1e-4, 0.0)] {
            let (mut squares, trials) = (0.0, 200);
            let error = {
                let readings = (WINDOW.to_mm - WINDOW.from_mm) / step;
                0.3 * 12.0_f64.sqrt() / (WINDOW.to_mm - WINDOW.from_mm) / readings.sqrt()
            };
            for _ in 0..trials {
                let true_u: Vec<f64> = readings(step).into_iter().filter(|u| *u < 0.06).collect();
                let u: Vec<f64> = true_u
                    .iter()
                    .map(|u| match resolution {
                        0.0 => u + jitter.sample(&mut rng),
                        resolution => (u / resolution).round() * resolution,
                    })
                    .collect();
                let y: Vec<f64> = true_u
                    .iter()
                    .map(|u| 1200.0 * u - 4000.0 * u * u + noise.sample(&mut rng))
                    .collect();
                let inside: Vec<(f64, f64)> = u
                    .iter()
                    .copied()
                    .zip(y.iter().copied())
                    .filter(|p| (WINDOW.from_mm..=WINDOW.to_mm).contains(&p.0))
                    .collect();
                let noisy_slope = Line::of(&u, &y, WINDOW).unwrap().slope;
                squares += (noisy_slope - line_of_points(&inside)).powi(2) / f64::from(trials);
            }
            // the gaps between readings at random displacements have a standard deviation of about their mean length.
            // This variation at most doubles the variance of the slope; half of the doubled variance is the variance of
            // the line through the readings, with which the slope is compared
            assert!(squares.sqrt() < 1.2 * error, "{step}: {} N/mm, {error}", squares.sqrt());
        }
    }
}
