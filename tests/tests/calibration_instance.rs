//! Compares the paper's model on a fixed instance with independent codes: densities and gradient to 1e-10, and the
//! posterior with two long independent runs (Stan and nutpie) within 4 standard errors.

use breccia_tests::fixed_size::calibration;
use breccia_tests::{Instance, assert_moments_of, number, numbers};
use models::{Specimens, calibration_on};
use ppl::prelude::*;
use ppl::{Bound, Model, Nuts, Workspace};
use serde_json::Value;

/// Unconstrained coordinates of a point from x, sd and the canonical partial correlations of the Cholesky factor.
fn unconstrained(x: [f64; 3], sd: [f64; 3], partial: [f64; 3]) -> Vec<f64> {
    // y = x/√(2 b_j) with b_j = η + (K − 2 − j)/2 for η = K = 3 (definitions of the LKJ map)
    let b = [3.5, 3.5, 3.0];
    let logit = x.map(|x| ((1.0 + x) / (1.0 - x)).ln());
    let correlation = [0, 1, 2].map(|i| partial[i].atanh() * (2.0f64 * b[i]).sqrt());
    [logit, sd.map(f64::ln), correlation].concat()
}

/// Canonical partial correlations (2,1), (3,1), (3,2) of a Cholesky factor.
fn partials(l: &Value) -> [f64; 3] {
    let at = |i: usize, j: usize| number(&l[i][j]);
    [at(1, 0), at(2, 0), at(2, 1) / (1.0 - at(2, 0) * at(2, 0)).sqrt()]
}

fn density<M: Model>(model: &Bound<M>, y: &[f64]) -> f64 {
    model.log_density_without_jacobian(y, &mut Workspace::default()).unwrap()
}

#[test]
fn golden_log_densities() {
    let instance = Instance::load();
    let prior = Instance::prior();
    let model = calibration(&instance.pce, &instance.qois, &prior);
    for golden in instance.json["golden_log_density"].as_array().unwrap() {
        let x = numbers::<3>(&golden["x"]);
        let qoi: [f64; 3] = instance.pce.at(x);
        for (got, expected) in qoi.into_iter().zip(numbers::<3>(&golden["qoi"])) {
            approx::assert_relative_eq!(got, expected, max_relative = 1e-12);
        }
        let y = unconstrained(x, numbers(&golden["sd"]), partials(&golden["L_corr"]));
        let expected = number(&golden["total"]);
        approx::assert_relative_eq!(density(&model, &y), expected, max_relative = 1e-10);
    }
}

#[test]
fn golden_gradient() {
    let instance = Instance::load();
    let prior = Instance::prior();
    let model = calibration(&instance.pce, &instance.qois, &prior);
    let golden = &instance.json["golden_gradient_stan_coordinates"];
    let u = numbers::<9>(&golden["u"]);
    let expected = numbers::<9>(&golden["grad"]);
    // the order of Stan's coordinates is x, correlations, ln sd; the order here is x, ln sd, scaled correlations
    let scale = [3.5, 3.5, 3.0].map(|b: f64| (2.0 * b).sqrt());
    let mut y = [0.0; 9];
    for i in 0..3 {
        y[i] = u[i];
        y[3 + i] = u[6 + i];
        y[6 + i] = u[3 + i] * scale[i];
    }
    let mut gradient = [0.0; 9];
    model.gradient(&y, &mut gradient, &mut Workspace::default()).unwrap();
    for i in 0..3 {
        for (got, expected) in [
            (gradient[i], expected[i]),
            (gradient[3 + i], expected[6 + i]),
            (gradient[6 + i] * scale[i], expected[3 + i]),
        ] {
            approx::assert_relative_eq!(got, expected, max_relative = 1e-10);
        }
    }
    ppl::check::gradient(&model, 1);
}

/// Compares the model with sizes known at compile time and the model with sizes known at run time: the density is the
/// same in the same coordinates.
#[test]
fn sizes_from_the_data_change_nothing() {
    let instance = Instance::load();
    let prior = Instance::prior();
    let fixed = calibration(&instance.pce, &instance.qois, &prior);
    let qois: Vec<Vec<f64>> = instance.qois.iter().map(|y| y.to_vec()).collect();
    let specimens = Specimens::new(&qois).unwrap();
    let by_data = calibration_on(&*instance.pce, &prior, &specimens);
    let golden = &instance.json["golden_gradient_stan_coordinates"];
    let y = numbers::<9>(&golden["u"]);
    approx::assert_relative_eq!(density(&by_data, &y), density(&fixed, &y), max_relative = 1e-12);
    let (mut a, mut b) = ([0.0; 9], [0.0; 9]);
    let value = fixed.gradient(&y, &mut a, &mut Workspace::default()).unwrap();
    let other = by_data.gradient(&y, &mut b, &mut Workspace::default()).unwrap();
    approx::assert_relative_eq!(value, other, max_relative = 1e-12);
    for (a, b) in a.iter().zip(b) {
        approx::assert_relative_eq!(*a, b, max_relative = 1e-11);
    }
    ppl::check::gradient(&by_data, 1);
}

#[test]
fn posterior_of_two_independent_programs() {
    let instance = Instance::load();
    let reference: Value =
        serde_json::from_str(include_str!("../fixtures/calibration_reference.json")).unwrap();
    let prior = Instance::prior();
    let model = calibration(&instance.pce, &instance.qois, &prior);
    let posterior = Nuts::default().chains(4).draws(5000).seed(11).sample(&model).unwrap();
    assert_eq!(posterior.summary().rows.iter().filter(|row| row.rhat >= 1.01).count(), 0);
    let names = [
        ("x[1]", "young_mpa"),
        ("x[2]", "toughness_n_per_mm"),
        ("x[3]", "viscosity_mpa_s"),
        ("sd[1]", "sd[0]"),
        ("sd[2]", "sd[1]"),
        ("sd[3]", "sd[2]"),
    ];
    for (theirs, ours) in names {
        compare(&posterior.trace(ours).unwrap(), ours, &reference["params"][theirs]);
    }
    // correlations R = L Lᵀ from the rows of the factor
    let l = |i: usize, j: usize| posterior.trace(&format!("corr[{i},{j}]")).unwrap();
    let (l10, l11, l20, l21) = (l(1, 0), l(1, 1), l(2, 0), l(2, 1));
    let r21: Vec<Vec<f64>> = (0..l10.len())
        .map(|c| (0..l10[c].len()).map(|d| l20[c][d] * l10[c][d] + l21[c][d] * l11[c][d]).collect())
        .collect();
    for (name, trace) in [("corr[1]", &l10), ("corr[2]", &l20), ("corr[3]", &r21)] {
        compare(trace, name, &reference["params"][name]);
    }
}

fn compare(chains: &[Vec<f64>], name: &str, reference: &Value) {
    for program in ["stan", "nutpie"] {
        let r = &reference[program];
        let (mean, sd) = (number(&r["mean"]), number(&r["sd"]));
        // the relative error of the reference's sd is about the error for a normal sample with the same effective size
        let sd_error = sd / (2.0 * number(&r["ess_bulk"])).sqrt();
        assert_moments_of(chains, name, (mean, number(&r["mcse_mean"])), (sd, sd_error));
    }
}
