//! Calibration to whole curves that follow a known formula.
//!
//! F(u) = s u exp(−(u/a)ᵖ/p) has the peak s a e^(−1/p) at u = a, and the shape x e^((1 − xᵖ)/p) with x = u/a. Peak
//! force and displacement at peak determine only two of the three parameters; the shape determines the third.

use models::{Evidence, Prior, Qois, Quantity, TestCurve, calibrate};
use nalgebra::{DMatrix, DVector};
use ppl::Nuts;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};

const TRUTH: [f64; 3] = [1200.0, 0.11, 3.0];
/// Standard deviations of the logarithms of the parameters between specimens.
const SCATTER: [f64; 3] = [0.03, 0.02, 0.05];
const SPECIMENS: usize = 60;
const PERCENT: [u8; 3] = [25, 50, 75];

fn curve([s, a, p]: [f64; 3], noise: &mut dyn FnMut() -> f64) -> TestCurve {
    let displacement_mm: Vec<f64> = (0..=90).map(|i| 0.002 * f64::from(i)).collect();
    let force = |&u: &f64| s * u * (-(u / a).powf(p) / p).exp() + noise();
    let force_n = displacement_mm.iter().map(force).collect();
    TestCurve::new(displacement_mm, force_n)
}

/// Peak force, displacement at peak and shape by the formula.
fn exact([s, a, p]: [f64; 3]) -> Vec<f64> {
    let shape = PERCENT.map(|percent| {
        let x = 0.01 * f64::from(percent);
        x * ((1.0 - x.powf(p)) / p).exp()
    });
    [s * a * (-1.0 / p).exp(), a].into_iter().chain(shape).collect()
}

/// Generalised least squares with the formula: estimate and standard deviations.
fn least_squares(specimens: &[Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let n = specimens.len() as f64;
    let rows: Vec<DVector<f64>> = specimens.iter().map(|y| DVector::from_row_slice(y)).collect();
    let mean = rows.iter().sum::<DVector<f64>>() / n;
    let scatter = rows.iter().map(|y| (y - &mean) * (y - &mean).transpose()).sum::<DMatrix<f64>>();
    let precision = (scatter / (n - 1.0)).try_inverse().unwrap();
    let mut at = TRUTH;
    let mut covariance = DMatrix::zeros(3, 3);
    for _ in 0..10 {
        let response = DVector::from_vec(exact(at));
        let jacobian = DMatrix::from_fn(response.len(), 3, |m, i| {
            let h = 1e-6 * at[i];
            let moved = |by: f64| {
                let mut x = at;
                x[i] += by;
                exact(x)[m]
            };
            (moved(h) - moved(-h)) / (2.0 * h)
        });
        let weighted = jacobian.transpose() * &precision;
        covariance = (&weighted * &jacobian).try_inverse().unwrap();
        let step = &covariance * &weighted * (&mean - response);
        (0..3).for_each(|i| at[i] += step[i]);
    }
    (at.to_vec(), (0..3).map(|i| (covariance[(i, i)] / n).sqrt()).collect())
}

/// Posterior means and standard deviations of the parameters, for a calibration to these quantities of the curves.
fn posterior(specimens: &[TestCurve], quantities: &[Quantity]) -> Vec<[f64; 2]> {
    let bounds = [("s", 900.0, 1500.0), ("a", 0.08, 0.14), ("p", 2.0, 4.0)];
    let inputs: Vec<Input> =
        bounds.map(|(name, low, high)| Input::new(name, low, high).unwrap()).to_vec();
    let points = DesignMethod::Sobol.sample(&inputs, 80, 1).unwrap();
    let outputs = quantities.iter().map(|q| q.column().into_owned()).collect();
    let mut runs = Dataset::new(inputs, outputs, "formula").unwrap();
    for x in points {
        let curve = curve([x[0], x[1], x[2]], &mut || 0.0);
        runs.push(&x, &Qois::values_of(&curve, 0.3, quantities).unwrap()).unwrap();
    }
    let fit = DynPce::fit(&runs, &FitOptions { max_order: 4, ..FitOptions::default() }).unwrap();
    let qois = specimens.iter().map(|curve| Qois::values_of(curve, 0.3, quantities).unwrap());
    let evidence = Evidence { qois: qois.collect(), ..Evidence::default() };
    let sampler = Nuts::default().chains(2).warmup(400).draws(1000).seed(5);
    let result =
        calibrate(&fit.pce, &Prior::uniform_on(fit.pce.inputs()), &evidence, &sampler, 5).unwrap();
    let theta = result.posterior.posterior.get("theta").unwrap();
    let of = |i: usize| {
        let draws: Vec<f64> = theta.data.iter().skip(i).step_by(3).copied().collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        [mean, variance.sqrt()]
    };
    (0..3).map(of).collect()
}

#[test]
fn whole_curves_find_what_peaks_leave_open() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let specimens: Vec<TestCurve> = (0..SPECIMENS)
        .map(|_| {
            let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
            let own = [0, 1, 2].map(|i| TRUTH[i] * (SCATTER[i] * normal()).exp());
            curve(own, &mut || 0.2 * normal())
        })
        .collect();
    let quantities = Quantity::of_curve(&PERCENT);
    let measured: Vec<Vec<f64>> =
        specimens.iter().map(|c| Qois::values_of(c, 0.3, &quantities).unwrap()).collect();
    let (estimate, errors) = least_squares(&measured);
    let found = posterior(&specimens, &quantities);
    for i in 0..3 {
        let [mean, sd] = found[i];
        // with 60 specimens the relative error of the covariance, and of the standard deviations, is about a tenth
        assert!((mean - estimate[i]).abs() < 0.25 * errors[i], "{i}: {found:?} {estimate:?}");
        assert!((sd / errors[i] - 1.0).abs() < 0.15, "{i}: {found:?} {errors:?}");
        assert!((mean - TRUTH[i]).abs() < 3.5 * sd, "{i}: {found:?}");
    }
    // without the shape the posterior of the exponent is its prior
    let peaks = posterior(&specimens, &quantities[..2]);
    let prior_sd = 2.0 / 12f64.sqrt();
    assert!(peaks[2][1] > 0.5 * prior_sd, "{peaks:?}");
    assert!(found[2][1] < 0.05 * prior_sd, "{found:?}");
}
