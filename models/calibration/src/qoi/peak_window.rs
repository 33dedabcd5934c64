//! The peak of a noisy curve: a polynomial over a window of displacement around the peak.

use super::fits::Polynomial;

/// Degrees of the polynomials and half widths of the windows, as fractions of the displacement from the start of the
/// curve to the peak.
const WINDOWS: [(usize, f64); 15] = [
    (2, 0.04),
    (2, 0.07),
    (2, 0.14),
    (2, 0.2),
    (2, 0.3),
    (3, 0.1),
    (3, 0.14),
    (3, 0.2),
    (3, 0.3),
    (3, 0.45),
    (4, 0.14),
    (4, 0.2),
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
/// Median and standard deviation of the logarithm of plausible exponents, see [`Bundle`]. Viscous damage has the exponent
/// 3, and the curves that are mentioned at [`CUBIC`] have 2.5 … 3.4; brittle specimens have larger exponents.
const EXPONENT: (f64, f64) = (3.0, 0.7);
/// Limits of the exponent.
const EXPONENTS: [f64; 2] = [0.5, 30.0];
/// Limit of selections; each selection uses the exponent of the preceding fit.
const SELECTIONS: usize = 5;

/// Curve of a bundle of fibres with Weibull-distributed strengths, F ∝ x exp((1 − xᵖ)/p) with x = u/d and the
/// exponent p. Its peak is at x = 1 and has the relative curvature F″ d²/F = −p. With p = 3, the curve is the curve
/// of viscous damage.
///
/// Reference: Daniels, Proc. R. Soc. Lond. A 183 (1945) 405, doi:10.1098/rspa.1945.0011.
#[derive(Clone, Copy)]
struct Bundle {
    exponent: f64,
}

impl Bundle {
    /// Deviation of the force from the peak force, relative to the peak force.
    fn deviation(self, x: f64) -> f64 {
        x * ((1.0 - x.max(0.0).powf(self.exponent)) / self.exponent).exp() - 1.0
    }

    /// Curve with the curvature of a fit at its peak, relative to peak force and displacement at peak. The logarithm
    /// of the exponent is the mean of two logarithms, weighted by their precisions: the logarithm from the fit and
    /// the median of [`EXPONENT`]. `deviation` is the standard deviation of the curvature.
    fn of_curvature(curvature: f64, deviation: f64) -> Self {
        let (median, prior) = EXPONENT;
        let [least, largest] = EXPONENTS;
        let measured = (-curvature).clamp(least, largest);
        let (of_fit, of_prior) = ((measured / deviation).powi(2), prior.powi(-2));
        let log = (of_fit * measured.ln() + of_prior * median.ln()) / (of_fit + of_prior);
        Self { exponent: log.exp() }
    }
}

/// The selected fit.
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
/// - its squared bias for the curve of a [`Bundle`] with the curvature of the readings, and for a cubic (x − 1)³ with the
///   coefficient [`CUBIC`], both sampled at the readings;
/// - the mean square of its residuals in excess of the noise, so that a sudden drop excludes wide windows.
///
/// The squared relative errors of force and displacement are added. The error of the displacement has the weight 1/3,
/// because an error of 1 % of one reading changes the displacement about three times as much as the force. The
/// curvature is taken from the selected fit, and the selection is repeated until the selected fit does not change.
pub(super) fn best_fit(u: &[f64], force: &[f64], top_mm: f64, noise_n: f64) -> Option<Fit> {
    let origin = u.iter().copied().fold(f64::INFINITY, f64::min);
    let start = smoothed_top(u, force, top_mm - origin)?;
    let curve = NoisyCurve { u, force, origin, noise_n };
    let fits =
        WINDOWS.iter().filter_map(|&(degree, width)| curve.centred_fit(start, degree, width));
    let fits: Vec<CentredFit> = fits.collect();
    let mut bundle = Bundle { exponent: EXPONENT.0 };
    let mut selected = None;
    for _ in 0..SELECTIONS {
        let errors = fits.iter().map(|fit| curve.squared_error(fit, bundle));
        let (best, _) = errors.enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
        if selected == Some(best) {
            break;
        }
        selected = Some(best);
        bundle = curve.bundle(&fits[best]);
    }
    let CentredFit { polynomial, centre, x, readings, .. } = fits.into_iter().nth(selected?)?;
    let (at_mm, force_n) = (centre + x, polynomial.at(x));
    Some(Fit { at_mm, force_n, readings, degree: polynomial.degree() })
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

/// A fit whose window is centred on its own peak, with its readings.
struct CentredFit {
    polynomial: Polynomial,
    /// Middle of the window, mm. The polynomial is a function of the distance from this middle.
    centre: f64,
    /// Distance of the peak to the middle of the window, mm.
    x: f64,
    readings: Vec<usize>,
    /// Distance to the middle of the window and force of each reading.
    centred_readings: Vec<(f64, f64)>,
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
    /// Fits a polynomial of this degree in a window that is centred on the peak of the fit. `None` if the window has too
    /// few readings, the fit has no peak, or its curvature there is not at least three standard deviations below zero.
    fn centred_fit(&self, start: f64, degree: usize, width: f64) -> Option<CentredFit> {
        let mut centre = start;
        let mut centred = None;
        for _ in 0..ITERATIONS {
            let half_width = width * (centre - self.origin);
            let inside = |i: &usize| (self.u[*i] - centre).abs() <= half_width;
            let readings: Vec<usize> = (0..self.u.len()).filter(inside).collect();
            if readings.len() < degree + 3 {
                return None;
            }
            let centred_readings: Vec<_> =
                readings.iter().map(|&i| (self.u[i] - centre, self.force[i])).collect();
            let polynomial = Polynomial::of(&centred_readings, degree);
            let x = polynomial.maximum(0.0, ends(&centred_readings))?;
            let is_unchanged = x.abs() < 1e-3 * half_width;
            centred = Some(CentredFit { polynomial, centre, x, readings, centred_readings });
            if is_unchanged {
                break;
            }
            centre += x;
        }
        let fit = centred?;
        let deviation = self.noise_n * fit.polynomial.variances(fit.x).curvature.sqrt();
        (fit.polynomial.jet(fit.x).curvature <= -3.0 * deviation).then_some(fit)
    }

    /// Returns the curve of a [`Bundle`] that has, at its peak, the relative curvature of the fit.
    fn bundle(&self, fit: &CentredFit) -> Bundle {
        let peak = fit.polynomial.jet(fit.x);
        let relative = (fit.centre + fit.x - self.origin).powi(2) / peak.value;
        let deviation = self.noise_n * fit.polynomial.variances(fit.x).curvature.sqrt();
        Bundle::of_curvature(peak.curvature * relative, deviation * relative)
    }

    /// Sum of the expected squared relative errors of peak force and displacement at peak.
    fn squared_error(&self, fit: &CentredFit, bundle: Bundle) -> f64 {
        let CentredFit { polynomial, centred_readings, x, centre, .. } = fit;
        let peak = polynomial.jet(*x);
        let variances = polynomial.variances(*x);
        let variance = self.noise_n * self.noise_n;
        let way = centre + x - self.origin;
        let degree = polynomial.degree();
        // squared errors of value and slope at the peak
        let (mut value, mut slope) = (variance * variances.value, variance * variances.slope);
        let cubic = CUBIC * (bundle.exponent / EXPONENT.0).powf(1.5);
        let references: [&dyn Fn(f64) -> f64; 2] =
            [&|t| bundle.deviation(t), &|t| cubic * (t - 1.0).powi(3)];
        for shape in references {
            let reference =
                centred_readings.iter().map(|p| (p.0, peak.value * shape(1.0 + (p.0 - x) / way)));
            let fitted = Polynomial::of(&reference.collect::<Vec<_>>(), degree).jet(*x);
            value += fitted.value * fitted.value;
            slope += fitted.slope * fitted.slope;
        }
        let freedom = (centred_readings.len() - degree - 1) as f64;
        let residuals =
            centred_readings.iter().map(|p| (p.1 - polynomial.at(p.0)).powi(2)).sum::<f64>();
        let misfit = residuals / freedom - variance * (1.0 + 2.0 * (2.0 / freedom).sqrt());
        if misfit > 0.0 {
            let ends = ends(centred_readings);
            value += misfit;
            // residuals with opposite signs at the two ends of the window are an error of the slope
            slope += misfit * (3.0 / (0.5 * (ends[1] - ends[0]))).powi(2) / 3.0;
        }
        let displacement = slope / (bundle.exponent * peak.value / way).powi(2);
        value / peak.value.powi(2) + displacement / 9.0
    }
}

/// Least and largest x.
fn ends(points: &[(f64, f64)]) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[least, largest], (x, _)| {
        [least.min(*x), largest.max(*x)]
    })
}
