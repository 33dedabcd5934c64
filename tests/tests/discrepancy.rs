//! Compares a calibration with a model discrepancy with the closed form of a linear model.

use models::{Evidence, Prior, calibrate};
use nalgebra::{DMatrix, DVector, dvector};
use ppl::Nuts;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{DynPce, Input};

const SPECIMENS: usize = 50;

/// Specimens with two quantities. The model predicts θ in [0, 2] for both; the measured second quantity is larger by
/// the relative error `more`.
fn specimens(more: f64) -> Vec<Vec<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
    (0..SPECIMENS)
        .map(|_| vec![1.0 + 0.02 * normal(), (1.0 + more) * (1.0 + 0.03 * normal())])
        .collect()
}

fn forward() -> DynPce {
    let theta = Input::new("theta", 0.0, 2.0).unwrap();
    let slope = 1.0 / 3f64.sqrt();
    let terms = [(vec![0], vec![1.0; 2]), (vec![1], vec![slope; 2])];
    DynPce::from_terms(vec![theta], vec!["a".into(), "b".into()], terms).unwrap()
}

/// Posterior mean and standard deviation of θ if the model's quantities have relative errors with the standard
/// deviations `sd`.
fn posterior(more: f64, sd: [f64; 2]) -> [f64; 2] {
    let shared = vec![vec![sd[0] * sd[0], 0.0], vec![0.0, sd[1] * sd[1]]];
    let evidence = Evidence { qois: specimens(more), shared, ..Evidence::default() };
    let sampler = Nuts::default().chains(2).warmup(400).draws(1500).seed(2);
    let result =
        calibrate(&forward(), &Prior::uniform_on(forward().inputs()), &evidence, &sampler, 2)
            .unwrap();
    let draws = &result.posterior.posterior.get("theta").unwrap().data;
    let n = draws.len() as f64;
    let mean = draws.iter().sum::<f64>() / n;
    [mean, (draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()]
}

/// Closed form of the mean V jᵀ C⁻¹ ȳ and the standard deviation √V of θ, where j contains the derivatives of the
/// quantities, ȳ is the mean of the n specimens, V = (jᵀ C⁻¹ j)⁻¹ and C = Σ/n + D. Σ is the sample covariance of the
/// specimens, and D is the covariance of the discrepancy in the units of the means.
fn closed_form(more: f64, sd: [f64; 2]) -> [f64; 2] {
    let rows: Vec<DVector<f64>> = specimens(more).into_iter().map(DVector::from_vec).collect();
    let n = rows.len() as f64;
    let mean = rows.iter().sum::<DVector<f64>>() / n;
    let scatter = rows.iter().map(|y| (y - &mean) * (y - &mean).transpose()).sum::<DMatrix<f64>>();
    let errors = DVector::from_fn(2, |i, _| (sd[i] * mean[i]).powi(2));
    let c = scatter / (n - 1.0) / n + DMatrix::from_diagonal(&errors);
    let weights = c.try_inverse().unwrap() * dvector![1.0, 1.0];
    let variance = weights.sum().recip();
    [variance * weights.dot(&mean), variance.sqrt()]
}

#[test]
fn an_error_of_the_model_widens_and_weighs_as_the_closed_form_says() {
    // without a discrepancy the deviation of 6 % would be attributed to the scatter between specimens
    let cases = [
        (0.0, [0.0, 0.0]),
        (0.06, [0.03, 0.03]),
        (0.06, [0.0, 0.1]),
        (0.06, [0.1, 0.0]),
        (0.06, [0.05, 0.02]),
    ];
    let found = cases.map(|(more, sd)| {
        let (found, exact) = (posterior(more, sd), closed_form(more, sd));
        // the calibration samples Σ: with 50 specimens its relative standard error is about a fifth
        assert!((found[0] - exact[0]).abs() < 0.2 * exact[1], "{sd:?}: {found:?} {exact:?}");
        assert!((found[1] / exact[1] - 1.0).abs() < 0.15, "{sd:?}: {found:?} {exact:?}");
        found
    });
    let [none, both, second, first, _] = found;
    // further specimens do not reduce the discrepancy, and the quantity without a discrepancy determines θ
    assert!(both[1] > 4.0 * none[1], "{found:?}");
    assert!((second[0] - 1.0).abs() < 0.01 && (first[0] - 1.06).abs() < 0.015, "{found:?}");
}
