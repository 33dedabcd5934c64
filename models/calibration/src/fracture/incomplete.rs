//! Posteriors of specimens that lack some quantities, compared with quadrature and between calibrations.

use std::collections::BTreeMap;

use ppl::{Nuts, Posterior, Sensitivity, check};

use super::six_specimens::{forward, priors, shared};
use super::{Evidence, JointTest, calibrate, calibrate_tests};
use crate::prior::{Prior, PriorFamily};

const MISSING: f64 = f64::NAN;
/// Slope and peak force of six specimens: one has no slope, two have no peak force.
const ROWS: [[f64; 2]; 6] =
    [[0.97, 1.02], [1.04, MISSING], [MISSING, 0.96], [0.93, 0.95], [1.06, 1.07], [1.09, MISSING]];

fn evidence() -> Evidence {
    Evidence { qois: ROWS.map(Vec::from).to_vec(), shared: shared(), ..Evidence::default() }
}

/// Factorises a symmetric matrix and returns the log density of the numbers `x` of a normal distribution with mean zero.
fn ln_normal(mut covariance: Vec<Vec<f64>>, mut x: Vec<f64>) -> f64 {
    let n = x.len();
    let mut ln_density = 0.0;
    // elimination without pivoting: column after column, with x as the right-hand side
    for k in 0..n {
        let pivot = covariance[k][k];
        ln_density -= 0.5 * (pivot.ln() + x[k] * x[k] / pivot);
        for i in k + 1..n {
            let factor = covariance[i][k] / pivot;
            for j in k..n {
                covariance[i][j] -= factor * covariance[k][j];
            }
            x[i] -= factor * x[k];
        }
    }
    ln_density
}

/// Returns the posterior mean and standard deviation of E and of the two standard deviations between specimens, and the
/// logarithm of the marginal likelihood. The integrals over E, both standard deviations and their correlation are computed
/// by quadrature. All recorded quantities together are one normal vector. The covariance of two quantities of the same
/// specimen is an entry of Σ + S, and the covariance of quantities of two specimens is an entry of S: Σ is the covariance
/// between specimens, and S is the covariance of the error that the specimens share.
fn by_quadrature() -> ([[f64; 2]; 3], f64) {
    let places: Vec<(usize, usize)> =
        (0..6).flat_map(|k| [(k, 0), (k, 1)]).filter(|&(k, m)| !ROWS[k][m].is_nan()).collect();
    let mean = |m: usize| {
        let values: Vec<f64> = ROWS.iter().map(|row| row[m]).filter(|x| !x.is_nan()).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    let means = [mean(0), mean(1)];
    let (shared, pce) = (shared(), forward());
    let midpoints = |a: f64, b: f64, n: usize| -> Vec<f64> {
        (0..n).map(|i| a + (b - a) * (i as f64 + 0.5) / n as f64).collect()
    };
    let (mut mass, mut sums) = (0.0, [[0.0; 2]; 3]);
    for e in midpoints(250.0, 300.0, 40) {
        let response = pce.value(&[e]).unwrap();
        let gaps: Vec<f64> =
            places.iter().map(|&(k, m)| (ROWS[k][m] - response[m]) / means[m]).collect();
        for a in midpoints(0.0, 0.4, 48) {
            for b in midpoints(0.0, 0.4, 48) {
                for r in midpoints(-1.0, 1.0, 24) {
                    let scatter = [[a * a, r * a * b], [r * a * b, b * b]];
                    let entry = |&(k, m): &(usize, usize), &(l, n): &(usize, usize)| {
                        shared[m][n] + if k == l { scatter[m][n] } else { 0.0 }
                    };
                    let covariance =
                        places.iter().map(|p| places.iter().map(|q| entry(p, q)).collect());
                    let prior = -0.5 * ((a - 0.15) / 0.25).powi(2)
                        - 0.5 * ((b - 0.15) / 0.25).powi(2)
                        + 2.0 * (1.0 - r * r).ln();
                    // the factor avoids an underflow
                    let weight =
                        (ln_normal(covariance.collect(), gaps.clone()) + prior - 20.0).exp();
                    mass += weight;
                    for (sum, x) in sums.iter_mut().zip([e, a, b]) {
                        sum[0] += weight * x;
                        sum[1] += weight * x * x;
                    }
                }
            }
        }
    }
    let moments = sums.map(|[first, second]| {
        let mean = first / mass;
        [mean, (second / mass - mean * mean).sqrt()]
    });
    // widths of the intervals in E (relative to the prior), in the standard deviations and in the correlation
    let cell = (1.0 / 40.0) * (0.4 / 48.0_f64).powi(2) * (2.0 / 24.0);
    let tau = 2.0 * std::f64::consts::PI;
    // truncated normal distribution: 0.25 √(2π) Φ(0.6); LKJ(3) of two quantities: 15/16 (1 − r²)²
    let of_sd = 0.25 * tau.sqrt() * 0.725_746_882_249_927;
    let ln_priors = (15.0_f64 / 16.0).ln() - 2.0 * of_sd.ln();
    let ln_normalisers = -0.5 * places.len() as f64 * tau.ln();
    (moments, mass.ln() + 20.0 + cell.ln() + ln_priors + ln_normalisers)
}

fn assert_moments(posterior: &Posterior, names: [&str; 3], expected: [[f64; 2]; 3]) {
    for (name, [mean, sd]) in names.into_iter().zip(expected) {
        check::mean(posterior, name, mean).within_mcse(4.0);
        check::sd(posterior, name, sd).within_mcse(4.0);
    }
}

/// The quantities are divided by the means of the recorded values. The posteriors of the single and of the joint
/// calibration agree with quadrature.
#[test]
fn the_posterior_of_incomplete_specimens_is_that_of_quadrature() {
    let (expected, ln_evidence) = by_quadrature();
    let sampler = Nuts::default().chains(4).draws(2000).seed(5).target_accept(0.9);
    let (pce, priors) = (forward(), priors());
    let single = calibrate(&pce, &priors, &evidence(), &sampler, 5).unwrap();
    assert_moments(&single.posterior, ["theta[matrix.young_mpa]", "sd[0]", "sd[1]"], expected);
    let test = JointTest {
        name: "only".to_owned(),
        forward: pce,
        priors,
        own: Vec::new(),
        evidence: evidence(),
    };
    let joint = calibrate_tests(&[test], &BTreeMap::new(), &sampler.seed(6), 0, 6).unwrap();
    assert_moments(
        &joint.posterior,
        ["theta[matrix.young_mpa]", "sd[slope (only)]", "sd[peak-force (only)]"],
        expected,
    );
    // single and joint model have the same marginal likelihood
    for found in [single.marginal_likelihood(3).unwrap(), joint.marginal_likelihood(3).unwrap()] {
        // the error of the quadrature is below 0.01
        assert!(
            (found.ln - ln_evidence).abs() < 0.01 + 4.0 * found.error,
            "{found:?} {ln_evidence}"
        );
    }
    // both models have the same sensitivities; the sensitivity to the uniform prior of E is zero
    let (a, b) = (single.prior_sensitivity().unwrap(), joint.prior_sensitivity().unwrap());
    for found in [&a, &b] {
        assert!(found.len() == 1 && found[0].parameter == "matrix.young_mpa", "{found:?}");
        // the density of the prior is constant, except for rounding errors
        assert!(found[0].prior < 1e-5, "{found:?}");
    }
    assert!(a[0].likelihood > 0.05, "{a:?}");
    assert!((a[0].likelihood - b[0].likelihood).abs() < 0.05, "{a:?} {b:?}");
}

/// A normal prior far from the data conflicts with the data. A narrow prior near values that agree with the data does
/// not conflict with the data.
#[test]
fn priors_that_conflict_with_the_data_are_sensitive() {
    let sampler = Nuts::default().chains(4).draws(2000).seed(5).target_accept(0.9);
    let pce = forward();
    let sensitivity = |mean: f64, sd: f64| {
        let prior = Prior::new(PriorFamily::Normal, &[mean, sd]).within(250.0, 300.0);
        let result = calibrate(&pce, &[prior], &evidence(), &sampler, 5).unwrap();
        result.prior_sensitivity().unwrap()[0].clone()
    };
    let conflict = sensitivity(290.0, 4.0);
    assert_eq!(conflict.diagnosis(), Sensitivity::PriorDataConflict, "{conflict:?}");
    let wide = sensitivity(275.0, 200.0);
    assert_eq!(wide.diagnosis(), Sensitivity::None, "{wide:?}");
}

/// If the importance weights of a specimen are unreliable, the posterior of the other specimens is sampled, even if
/// some of these specimens lack quantities. New specimens have all quantities.
#[test]
fn incomplete_specimens_are_left_out_and_predicted() {
    let sampler = Nuts::default().chains(2).draws(800).seed(5).target_accept(0.9);
    let single = calibrate(&forward(), &priors(), &evidence(), &sampler, 5).unwrap();
    let without = single.without_each(&sampler, 0, 5).unwrap();
    assert_eq!(without.len(), 6);
    assert!(without.iter().all(|one| one.elpd.is_finite()), "{without:?}");
    // one quantity has a smaller density than two quantities, each of which has a density of about 1/(0.1 √(2π))
    assert!(without[1].elpd < without[0].elpd, "{without:?}");
    let predicted = single.posterior.predictive.get("new_specimen").unwrap();
    assert!(predicted.data.iter().all(|x| x.is_finite()));
    assert_eq!(predicted.data.len(), 2 * 1600);
}

/// Only one specimen has the second quantity. If this specimen is left out, no specimen has the quantity, and the
/// posterior without the specimen is the posterior for the first quantity alone.
#[test]
fn a_quantity_of_one_specimen_can_be_left_out() {
    let mut qois = ROWS.map(Vec::from).to_vec();
    qois.iter_mut().skip(1).for_each(|row| row[1] = MISSING);
    qois[2][0] = 1.01;
    let evidence = Evidence { qois, shared: shared(), ..Evidence::default() };
    let sampler = Nuts::default().chains(2).draws(800).seed(5).target_accept(0.9);
    let single = calibrate(&forward(), &priors(), &evidence, &sampler, 5).unwrap();
    let without = single.without_each(&sampler, 0, 5).unwrap();
    assert!(without.iter().all(|one| one.elpd.is_finite()), "{without:?}");
}
