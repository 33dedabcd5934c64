//! Force–displacement curves that a posterior predicts for a new specimen.
//!
//! A curve is F(u) = F_p r(u/d_p) with the peak force F_p, the displacement at peak d_p and the shape r. The posterior
//! predicts F_p and d_p. The shape of each draw is the sum of the shape of the forward model, a random error of the
//! forward model, and a random deviation of the specimen. The deviation follows a multivariate Student distribution
//! whose scale matrix is the covariance of the shapes of the n tested specimens. A random deviation is computed from
//! the residuals of these shapes about their mean: the residuals are summed with independent standard normal weights,
//! and the sum is divided by the square root of a χ² variable with n − 1 degrees of freedom.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use ppl::diagnostics::quantile;
use rand::{Rng, SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::budget::matrix;
use crate::experiment::TestCurve;
use crate::qoi::{PeakedCurve, Qoi, QoiError, RelativeForce};

/// Distance between the points of a shape, in % of the displacement at peak.
const STEP: u8 = 5;
/// Number of equal intervals of displacement in a band.
const PLACES: usize = 80;
/// Fraction of the predicted curves that reach the end of the band.
const REACHING: f64 = 0.9;

/// Probabilities of the quantiles of a band.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Returns the largest displacement of a curve, in % of its displacement at peak.
pub fn largest_percentage(curve: &TestCurve) -> Result<f64, QoiError> {
    let peak_mm = PeakedCurve::new(curve, SLOPE_FRACTION)?.peak_mm();
    let end = curve.displacement_mm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Ok(100.0 * end / peak_mm)
}

/// Percentages of the displacement at peak at which shapes are evaluated. The last percentage is at most `reach`, the
/// smallest [`largest_percentage`] of all curves.
pub fn percentages(reach: f64) -> Vec<u8> {
    let last = reach.min(f64::from(RelativeForce::LARGEST_PERCENT)) / f64::from(STEP);
    (1..=last as u8).map(|i| i * STEP).collect()
}

/// Computes the shape of a curve: the forces at the given percentages of the displacement at peak, divided by the peak
/// force.
pub fn shape(curve: &TestCurve, percent: &[u8]) -> Result<Vec<f64>, QoiError> {
    let curve = PeakedCurve::new(curve, SLOPE_FRACTION)?;
    let quantities = percent.iter().filter_map(|&percent| RelativeForce::new(percent));
    quantities.map(|quantity| quantity.value(&curve)).collect()
}

/// Slope fraction for the computation of the quantities; it does not affect the shape.
const SLOPE_FRACTION: f64 = 0.5;

/// Prediction for a new specimen from one draw of the posterior.
#[derive(Clone, Debug)]
pub struct PredictedSpecimen {
    pub peak_force_n: f64,
    pub displacement_at_peak_mm: f64,
    /// Shape of the forward model at the draw's parameters.
    pub shape: Vec<f64>,
}

/// Quantiles of the force of a new specimen along the displacement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PredictedCurves {
    pub displacement_mm: Vec<f64>,
    /// Quantiles of the force at each displacement, with the probabilities [`QUANTILES`], N.
    pub force_n: Vec<[f64; QUANTILES.len()]>,
}

impl PredictedCurves {
    /// Computes the band from posterior draws. The shapes of `draws` and of the tested specimens (`specimens`, one
    /// row each) are given at the percentages `percent`. `error` is the covariance of the forward model's error of
    /// the shape. The band ends at the displacement that nine of ten predicted curves reach. Shorter curves are
    /// extrapolated by the parabola through their last three points.
    pub fn of(
        percent: &[u8],
        draws: &[PredictedSpecimen],
        specimens: &[Vec<f64>],
        error: &[Vec<f64>],
        seed: u64,
    ) -> Self {
        let (Some(&last), false) = (percent.last(), draws.is_empty()) else {
            return Self::default();
        };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let (scatter, error) = (Scatter::of(specimens), root(&matrix(error)));
        let curves: Vec<(f64, f64, Vec<f64>)> = draws
            .iter()
            .map(|draw| {
                let normal = DVector::from_fn(error.ncols(), |_, _| rng.sample(StandardNormal));
                let (off, deviation) = (&error * normal, scatter.draw(&mut rng));
                let shape =
                    draw.shape.iter().zip(&off).zip(&deviation).map(|((r, a), b)| r + a + b);
                (draw.displacement_at_peak_mm, draw.peak_force_n, shape.collect())
            })
            .collect();
        let ends: Vec<f64> = curves.iter().map(|(d, ..)| 0.01 * f64::from(last) * d).collect();
        let end = quantile(&ends, 1.0 - REACHING);
        let at = |i: usize| end * i as f64 / PLACES as f64;
        let displacement_mm: Vec<f64> = (0..=PLACES).map(at).collect();
        let quantiles = |u: &f64| {
            let mut forces: Vec<f64> = curves
                .iter()
                .map(|(width, height, shape)| height * relative(percent, shape, 100.0 * u / width))
                .collect();
            // sort once: `quantile` sorts its argument in each call, which is fast for sorted values
            forces.sort_by(f64::total_cmp);
            QUANTILES.map(|p| quantile(&forces, p))
        };
        let force_n = displacement_mm.iter().map(quantiles).collect();
        Self { displacement_mm, force_n }
    }
}

/// Scatter of the curve shapes of the tested specimens.
struct Scatter {
    /// Deviations of the shapes from their mean, divided by √(n − 1), one row per specimen.
    residuals: Vec<Vec<f64>>,
}

impl Scatter {
    fn of(specimens: &[Vec<f64>]) -> Self {
        let (n, size) = (specimens.len() as f64, specimens.first().map_or(0, Vec::len));
        let mean: Vec<f64> =
            (0..size).map(|i| specimens.iter().map(|row| row[i]).sum::<f64>() / n).collect();
        let root = (n - 1.0).max(1.0).sqrt();
        let residual =
            |row: &Vec<f64>| row.iter().zip(&mean).map(|(r, m)| (r - m) / root).collect();
        Self { residuals: specimens.iter().map(residual).collect() }
    }

    fn draw<R: Rng>(&self, rng: &mut R) -> Vec<f64> {
        let mut sum = vec![0.0; self.residuals.first().map_or(0, Vec::len)];
        let freedom = self.residuals.len() as f64 - 1.0;
        let Ok(squares) = ChiSquared::new(freedom) else { return sum };
        let stretch = (freedom / squares.sample(rng)).sqrt();
        for row in &self.residuals {
            let weight = stretch * rng.sample::<f64, _>(StandardNormal);
            sum.iter_mut().zip(row).for_each(|(sum, r)| *sum += weight * r);
        }
        sum
    }
}

/// Returns a matrix A with A Aᵀ = `covariance`, which may be singular.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(covariance.clone());
    eigenvectors * DMatrix::from_diagonal(&eigenvalues.map(|value| value.max(0.0).sqrt()))
}

/// Interpolates a shape at the percentage `at` of the displacement at peak; the result is relative to the peak force.
/// The interpolation starts from the origin and is linear between the points. Beyond the last point, the result follows
/// the parabola through the last three points.
fn relative(percent: &[u8], shape: &[f64], at: f64) -> f64 {
    let position = |i: usize| f64::from(percent[i]);
    let k = percent.partition_point(|&p| f64::from(p) < at);
    if k == 0 {
        return shape[0] * at / position(0);
    }
    if k < percent.len() {
        let part = (at - position(k - 1)) / (position(k) - position(k - 1));
        return shape[k - 1] + part * (shape[k] - shape[k - 1]);
    }
    let Some(first) = k.checked_sub(3) else { return shape[k - 1] };
    (first..k)
        .map(|i| {
            let others = (first..k).filter(|&j| j != i);
            shape[i]
                * others.map(|j| (at - position(j)) / (position(i) - position(j))).product::<f64>()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the shape x e^((1 − x^a)/a): for every a, the peak is at x = 1 and has the value 1.
    fn family(a: f64, x: f64) -> f64 {
        x * ((1.0 - x.powf(a)) / a).exp()
    }

    fn shape_of(a: f64, percent: &[u8]) -> Vec<f64> {
        percent.iter().map(|&p| family(a, 0.01 * f64::from(p))).collect()
    }

    fn curve(height: f64, width: f64, a: f64) -> TestCurve {
        let displacement_mm: Vec<f64> = (0..=60).map(|i| 0.002 * f64::from(i)).collect();
        let force_n = displacement_mm.iter().map(|u| height * family(a, u / width)).collect();
        TestCurve::new(displacement_mm, force_n)
    }

    #[test]
    fn shapes_are_read_as_far_as_every_curve_goes_and_drawn_again() {
        let curves = [curve(140.0, 0.1, 3.0), curve(120.0, 0.107, 2.5)];
        let reach = curves.each_ref().map(|curve| largest_percentage(curve).unwrap());
        let percent = percentages(reach[0].min(reach[1]));
        assert_eq!((percent[0], *percent.last().unwrap()), (5, 110));
        let relative_shape = shape(&curves[0], &percent).unwrap();
        for (x, tolerance) in
            [(2.0, 2e-3), (37.0, 2e-3), (81.0, 6e-3), (100.0, 6e-3), (114.0, 1e-2)]
        {
            let exact = family(3.0, 0.01 * x);
            assert!((relative(&percent, &relative_shape, x) - exact).abs() < tolerance, "{x}");
        }
        let nothing = TestCurve::default();
        assert!(largest_percentage(&nothing).is_err());
    }

    /// In many laboratories, eight specimens have random peak forces, displacements at peak and shapes. The 90 % band
    /// contains 90 % of the curves of new specimens, and the 50 % band contains 50 %, on the rising branch and at the
    /// peak.
    #[test]
    fn bands_hold_the_share_of_new_curves_that_they_state() {
        let percent: Vec<u8> = (1..=24).map(|i| 5 * i).collect();
        let (n, laboratories) = (8, 500);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let mut normal = move || rng.sample::<f64, _>(StandardNormal);
        let (sd, sd_of_shape, off) = ([7.0, 0.006], 0.25, 0.1);
        let places = [0.03, 0.07, 0.09, 0.1];
        let mut inside = [[0.0; 2]; 4];
        // derivative of the shape with respect to the exponent a; the error of the forward model is a normal error of
        // this exponent
        let slope: Vec<f64> = shape_of(3.01, &percent)
            .iter()
            .zip(shape_of(2.99, &percent))
            .map(|(a, b)| (a - b) / 0.02)
            .collect();
        let error: Vec<Vec<f64>> =
            slope.iter().map(|a| slope.iter().map(|b| a * b * off * off).collect()).collect();
        for laboratory in 0..laboratories {
            let truth = 3.0 + off * normal();
            let specimens: Vec<[f64; 3]> = (0..n)
                .map(|_| {
                    [
                        140.0 + sd[0] * normal(),
                        0.1 + sd[1] * normal(),
                        truth + sd_of_shape * normal(),
                    ]
                })
                .collect();
            let shapes: Vec<Vec<f64>> =
                specimens.iter().map(|s| shape_of(s[2], &percent)).collect();
            // predictive draws of a new specimen; the means are estimated from n specimens, and the scatter is known
            let wide = (1.0 + 1.0 / f64::from(n)).sqrt();
            let mean = |i: usize| specimens.iter().map(|s| s[i]).sum::<f64>() / f64::from(n);
            let draws: Vec<PredictedSpecimen> = (0..400)
                .map(|_| PredictedSpecimen {
                    peak_force_n: mean(0) + wide * sd[0] * normal(),
                    displacement_at_peak_mm: mean(1) + wide * sd[1] * normal(),
                    shape: shape_of(3.0, &percent),
                })
                .collect();
            let bands = PredictedCurves::of(&percent, &draws, &shapes, &error, laboratory);
            let new =
                [140.0 + sd[0] * normal(), 0.1 + sd[1] * normal(), truth + sd_of_shape * normal()];
            for (inside, u) in inside.iter_mut().zip(places) {
                let k = bands.displacement_mm.partition_point(|d| *d < u);
                let [a, b] = [k - 1, k].map(|k| (bands.displacement_mm[k], bands.force_n[k]));
                let part = (u - a.0) / (b.0 - a.0);
                let force = new[0] * family(new[2], u / new[1]);
                for (inside, [low, high]) in inside.iter_mut().zip([[0, 4], [1, 3]]) {
                    let at = |q: usize| a.1[q] + part * (b.1[q] - a.1[q]);
                    *inside += f64::from(u8::from((at(low)..=at(high)).contains(&force)));
                }
            }
        }
        let count = laboratories as f64;
        for (inside, u) in inside.iter().zip(places) {
            for (inside, nominal) in inside.iter().zip([0.9, 0.5f64]) {
                let error = (nominal * (1.0 - nominal) / count).sqrt();
                let share = inside / count;
                assert!((share - nominal).abs() < 3.5 * error, "{u}: {share} of {nominal}");
            }
        }
    }
}
