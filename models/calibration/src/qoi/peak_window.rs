//! The peak of a noisy curve: a polynomial over a window of displacement around it.

use super::fits::Polynomial;

/// Deviation of the force from the peak force as a function of displacement, relative to peak force and displacement at
/// peak.
type Shape = fn(f64) -> f64;

/// Degrees of the polynomials and half widths of the windows, as fractions of the displacement from the start of the
/// curve to the peak.
const WINDOWS: [(usize, f64); 10] = [
    (2, 0.07),
    (2, 0.14),
    (2, 0.2),
    (2, 0.3),
    (3, 0.2),
    (3, 0.3),
    (3, 0.45),
    (4, 0.28),
    (4, 0.4),
    (4, 0.55),
];
/// Limit of fits per window; each fit centres the window on the peak of the preceding fit.
const ITERATIONS: usize = 12;
/// Standard deviation of the cubic coefficient of plausible curves, relative to peak force and displacement at peak.
/// The five curves of `breccia init --own-data` and four simulations with up to 2.4 million elements have coefficients
/// of −0.6 … 0.3.
const CUBIC: f64 = 0.35;
/// Relative curvature F″ d²/F at the peak of viscous damage. The curves that are mentioned at [`CUBIC`] have −2.5 …
/// −3.4.
const CURVATURE: f64 = -3.0;

/// A fit whose window is centred on its own peak.
pub(super) struct Fit {
    /// Displacement at peak in mm.
    pub(super) at_mm: f64,
    pub(super) force_n: f64,
    /// Indices of the readings in the window.
    pub(super) readings: Vec<usize>,
    /// Degree of the polynomial.
    pub(super) degree: usize,
}

/// Selects the fit with the smallest expected error among [`WINDOWS`]; `None` if no fit has a peak that exceeds its
/// noise.
///
/// The expected squared error of a fit is the sum of
/// - its variance: the noise, through the weights that the fit gives to the readings in its window;
/// - its squared bias for the curve of viscous damage, F ∝ x exp((1 − x³)/3), x = u/d, and for a cubic (x − 1)³ with
///   the coefficient [`CUBIC`], both sampled at the readings;
/// - the mean square of its residuals in excess of the noise, so that a sudden drop excludes wide windows.
///
/// The squared relative errors of force and displacement are added. The error of the displacement has the weight 1/3,
/// because an error of 1 % of one reading changes the displacement about three times as much as the force.
pub(super) fn best_fit(u: &[f64], force: &[f64], top_mm: f64, noise_n: f64) -> Option<Fit> {
    let origin = u.iter().copied().fold(f64::INFINITY, f64::min);
    let start = smoothed_top(u, force, top_mm - origin)?;
    let curve = NoisyCurve { u, force, origin, noise_n };
    let fits =
        WINDOWS.iter().filter_map(|&(degree, width)| curve.centred_fit(start, degree, width));
    fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, fit)| fit)
}

/// Displacement at which the moving average of the force is highest. Its window extends to both sides by 0.12 `way_mm`,
/// where `way_mm` is the displacement from the start of the curve to the highest reading.
fn smoothed_top(u: &[f64], force: &[f64], way_mm: f64) -> Option<f64> {
    let mut readings: Vec<(f64, f64)> = u.iter().copied().zip(force.iter().copied()).collect();
    readings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sums = vec![0.0];
    sums.extend(readings.iter().scan(0.0, |sum, reading| {
        *sum += reading.1;
        Some(*sum)
    }));
    let half_width = 0.12 * way_mm;
    let mean = |at: f64| {
        let from = readings.partition_point(|reading| reading.0 < at - half_width);
        let to = readings.partition_point(|reading| reading.0 <= at + half_width);
        (sums[to] - sums[from]) / (to - from) as f64
    };
    let means = readings.iter().map(|reading| (mean(reading.0), reading.0));
    means.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
}

struct NoisyCurve<'a> {
    u: &'a [f64],
    force: &'a [f64],
    /// Smallest displacement in mm.
    origin: f64,
    /// Standard deviation of a reading's force.
    noise_n: f64,
}

impl NoisyCurve<'_> {
    /// Fits a polynomial of this degree in a window that is centred on the peak of the fit. Also returns the expected
    /// squared error. `None` if the window has too few readings, or the fit has no peak.
    fn centred_fit(&self, start: f64, degree: usize, width: f64) -> Option<(f64, Fit)> {
        let mut centre = start;
        let mut centred = None;
        for _ in 0..ITERATIONS {
            let half_width = width * (centre - self.origin);
            let inside = |i: &usize| (self.u[*i] - centre).abs() <= half_width;
            let readings: Vec<usize> = (0..self.u.len()).filter(inside).collect();
            if readings.len() < degree + 3 {
                return None;
            }
            let points: Vec<_> =
                readings.iter().map(|&i| (self.u[i] - centre, self.force[i])).collect();
            let polynomial = Polynomial::of(&points, degree);
            let x = polynomial.maximum(0.0, ends(&points))?;
            let is_unchanged = x.abs() < 1e-3 * half_width;
            centred = Some((polynomial, x, centre, readings, points));
            if is_unchanged {
                break;
            }
            centre += x;
        }
        let (polynomial, x, centre, readings, points) = centred?;
        let error = self.squared_error(&polynomial, &points, x, centre)?;
        let (at_mm, force_n) = (centre + x, polynomial.at(x));
        Some((error, Fit { at_mm, force_n, readings, degree }))
    }

    /// Expected squared error of peak force and displacement at peak, relative. `None` if the curvature at the peak is
    /// not at least three standard deviations below zero.
    fn squared_error(
        &self,
        polynomial: &Polynomial,
        points: &[(f64, f64)],
        x: f64,
        centre: f64,
    ) -> Option<f64> {
        let peak = polynomial.jet(x);
        let variances = polynomial.variances(x);
        let variance = self.noise_n * self.noise_n;
        if peak.curvature > -3.0 * (variance * variances.curvature).sqrt() {
            return None;
        }
        let way = centre + x - self.origin;
        let degree = polynomial.degree();
        // squared errors of value and slope at the peak
        let (mut value, mut slope) = (variance * variances.value, variance * variances.slope);
        let references: [(Shape, f64); 2] =
            [(|t| t * ((1.0 - t.powi(3)) / 3.0).exp() - 1.0, 1.0), (|t| (t - 1.0).powi(3), CUBIC)];
        for (shape, size) in references {
            let scale = size * peak.value;
            let reference = points.iter().map(|p| (p.0, scale * shape(1.0 + (p.0 - x) / way)));
            let found = Polynomial::of(&reference.collect::<Vec<_>>(), degree).jet(x);
            value += found.value * found.value;
            slope += found.slope * found.slope;
        }
        let freedom = (points.len() - degree - 1) as f64;
        let residuals = points.iter().map(|p| (p.1 - polynomial.at(p.0)).powi(2)).sum::<f64>();
        let misfit = residuals / freedom - variance * (1.0 + 2.0 * (2.0 / freedom).sqrt());
        if misfit > 0.0 {
            let ends = ends(points);
            value += misfit;
            // residuals with opposite signs at the two ends of the window are an error of the slope
            slope += misfit * (3.0 / (0.5 * (ends[1] - ends[0]))).powi(2) / 3.0;
        }
        let displacement = slope / (CURVATURE * peak.value / way).powi(2);
        Some(value / peak.value.powi(2) + displacement / 9.0)
    }
}

/// Least and largest x.
fn ends(points: &[(f64, f64)]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], (x, _)| {
        [least.min(*x), largest.max(*x)]
    })
}
