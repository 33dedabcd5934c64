//! Fits with sparse terms, on test functions from the literature. The errors are relative mean squared errors at 20 000
//! independent points.

use std::f64::consts::PI;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, Terms};

type Bounds<'a> = [(&'a str, f64, f64)];

fn inputs(bounds: &Bounds<'_>) -> Vec<Input> {
    bounds.iter().map(|&(name, low, high)| Input::new(name, low, high).unwrap()).collect()
}

fn runs(bounds: &Bounds<'_>, n: usize, seed: u64, f: impl Fn(&[f64]) -> f64) -> Dataset {
    let inputs = inputs(bounds);
    let mut data = Dataset::new(inputs.clone(), vec!["f".into()], "closed form").unwrap();
    for x in DesignMethod::LatinHypercube.sample(&inputs, n, seed).unwrap() {
        data.push(&x, &[f(&x)]).unwrap();
    }
    data
}

fn options(max_order: usize) -> FitOptions {
    FitOptions { max_order, terms: Terms::Sparse, ..FitOptions::default() }
}

/// The mean squared error of a surrogate, as a fraction of the function's variance.
fn error(pce: &DynPce, f: impl Fn(&[f64]) -> f64) -> f64 {
    let test_points = DesignMethod::MonteCarlo.sample(pce.inputs(), 20_000, 99).unwrap();
    let exact: Vec<f64> = test_points.iter().map(|x| f(x)).collect();
    let mean = exact.iter().sum::<f64>() / exact.len() as f64;
    let square = |(x, y): (&Vec<f64>, &f64)| (pce.value(x).unwrap()[0] - y).powi(2);
    test_points.iter().zip(&exact).map(square).sum::<f64>()
        / exact.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
}

fn ishigami(x: &[f64]) -> f64 {
    x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
}

const ANGLES: [(&str, f64, f64); 3] = [("x1", -PI, PI), ("x2", -PI, PI), ("x3", -PI, PI)];

/// Flow of water through a borehole (Harper & Gupta 1983), all inputs uniform.
fn borehole(x: &[f64]) -> f64 {
    let [rw, r, tu, hu, tl, hl, l, kw] = x.try_into().unwrap();
    let log = (r / rw).ln();
    2.0 * PI * tu * (hu - hl) / (log * (1.0 + 2.0 * l * tu / (log * rw * rw * kw) + tu / tl))
}

const BOREHOLE: [(&str, f64, f64); 8] = [
    ("rw", 0.05, 0.15),
    ("r", 100.0, 50_000.0),
    ("tu", 63_070.0, 115_600.0),
    ("hu", 990.0, 1110.0),
    ("tl", 63.1, 116.0),
    ("hl", 700.0, 820.0),
    ("l", 1120.0, 1680.0),
    ("kw", 9855.0, 12_045.0),
];

/// Midpoint voltage of a push-pull circuit without output transformer (Ben-Ari & Steinberg 2007).
fn otl(x: &[f64]) -> f64 {
    let [rb1, rb2, rf, rc1, rc2, beta] = x.try_into().unwrap();
    let (vb1, by) = (12.0 * rb2 / (rb1 + rb2), beta * (rc2 + 9.0));
    (vb1 + 0.74) * by / (by + rf) + 11.35 * rf / (by + rf) + 0.74 * rf * by / ((by + rf) * rc1)
}

const OTL: [(&str, f64, f64); 6] = [
    ("rb1", 50.0, 150.0),
    ("rb2", 25.0, 70.0),
    ("rf", 0.5, 3.0),
    ("rc1", 1.2, 2.5),
    ("rc2", 0.25, 1.2),
    ("beta", 50.0, 300.0),
];

/// Weight of a light aircraft's wing (Forrester, Sóbester & Keane 2008).
fn wing(x: &[f64]) -> f64 {
    let [sw, wfw, a, sweep, q, taper, tc, nz, wdg, wp] = x.try_into().unwrap();
    let cos = (sweep * PI / 180.0).cos();
    0.036
        * sw.powf(0.758)
        * wfw.powf(0.0035)
        * (a / (cos * cos)).powf(0.6)
        * q.powf(0.006)
        * taper.powf(0.04)
        * (100.0 * tc / cos).powf(-0.3)
        * (nz * wdg).powf(0.49)
        + sw * wp
}

const WING: [(&str, f64, f64); 10] = [
    ("sw", 150.0, 200.0),
    ("wfw", 220.0, 300.0),
    ("a", 6.0, 10.0),
    ("sweep", -10.0, 10.0),
    ("q", 16.0, 45.0),
    ("taper", 0.5, 1.0),
    ("tc", 0.08, 0.18),
    ("nz", 2.5, 6.0),
    ("wdg", 1700.0, 2500.0),
    ("wp", 0.025, 0.08),
];

#[test]
fn errors_are_below_those_of_the_best_programs() {
    type Function = fn(&[f64]) -> f64;
    let cases: [(&str, &Bounds<'_>, Function, usize, usize, f64); 4] = [
        ("Ishigami", &ANGLES, ishigami, 100, 16, 1e-8),
        ("borehole", &BOREHOLE, borehole, 200, 5, 3e-5),
        ("OTL circuit", &OTL, otl, 100, 6, 5e-6),
        ("wing weight", &WING, wing, 500, 3, 1.5e-5),
    ];
    for (name, bounds, f, n, max_order, bar) in cases {
        for seed in [1, 2] {
            let fit = DynPce::fit(&runs(bounds, n, seed, f), &options(max_order)).unwrap();
            let relative_error = error(&fit.pce, f);
            let terms = fit.report.chosen().unwrap().terms;
            println!(
                "{name}, {n} runs: {relative_error:.1e} with {terms} terms of order {}, logarithms of {:?}",
                fit.report.order, fit.report.logarithmic
            );
            assert!(
                relative_error < bar,
                "{name}: {relative_error:e} above {bar:e}\n{}",
                fit.report
            );
        }
    }
}

/// Checks that a polynomial with few of many candidate terms is fitted exactly, with fewer runs than candidate terms.
#[test]
fn a_sparse_polynomial_is_found_again() {
    let f = |x: &[f64]| 2.0 + x[0] * x[1] + 3.0 * x[2].powi(5) - x[4] + 0.5 * x[3].powi(2) * x[0];
    let names = ["a", "b", "c", "d", "e"];
    let bounds: Vec<(&str, f64, f64)> = names.iter().map(|name| (*name, -1.0, 1.0)).collect();
    // order 5 in five inputs has 252 terms
    let fit = DynPce::fit(&runs(&bounds, 60, 3, f), &options(6)).unwrap();
    assert!(error(&fit.pce, f) < 1e-20);
    // x⁵ consists of three Legendre polynomials, and x²y of two
    assert_eq!(fit.report.chosen().unwrap().terms, 8, "{}", fit.report);
    assert_eq!(fit.report.order, 5);
    assert!(fit.leverage(&[0.3, -0.2, 0.9, 0.0, 1.0]).unwrap() < 1.0);
}

/// For pure noise, hardly any term is selected, and the errors are not too small. A leave-one-out error would claim
/// that the selected terms explain half of the noise, because the run that is left out has influenced their selection.
#[test]
fn noise_has_no_terms() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let bounds: Vec<(&str, f64, f64)> =
        ["a", "b", "c", "d", "e"].iter().map(|name| (*name, -1.0, 1.0)).collect();
    let inputs = inputs(&bounds);
    let mut data = Dataset::new(inputs.clone(), vec!["f".into()], "noise").unwrap();
    for x in DesignMethod::LatinHypercube.sample(&inputs, 60, 1).unwrap() {
        data.push(&x, &[rng.random::<f64>() - 0.5]).unwrap();
    }
    let fit = DynPce::fit(&data, &options(4)).unwrap();
    let chosen = fit.report.chosen().unwrap();
    assert!(chosen.terms <= 12, "{}", fit.report);
    assert!(chosen.loo.as_ref().unwrap().corrected[0] > 0.8, "{}", fit.report);
    // the scatter of the runs is the variance 1/12 of the noise, estimated from 60 runs
    let spread = fit.report.lack_of_fit(&[0.0]).unwrap()[0][0];
    assert!((12.0 * spread - 1.0).abs() < 0.4, "{spread}");
}

/// If all terms can be selected, both kinds of fit give the same polynomial; with derivatives, fewer runs are enough.
#[test]
fn several_outputs_and_derivatives_share_their_terms() {
    let inputs = inputs(&[("a", -1.0, 1.0), ("b", -1.0, 1.0)]);
    let (f, g) = (|a: f64, b: f64| a * a * b - b, |a: f64, b: f64| 1.0 + a * b.powi(3));
    let names = vec!["f".to_owned(), "g".to_owned()];
    let mut data =
        Dataset::new(inputs.clone(), names, "closed form").unwrap().with_derivatives().unwrap();
    for x in DesignMethod::Sobol.sample(&inputs, 8, 1).unwrap() {
        let (a, b) = (x[0], x[1]);
        let jacobian = [[2.0 * a * b, a * a - 1.0], [b.powi(3), 3.0 * a * b * b]];
        data.push_differentiated(&x, &[f(a, b), g(a, b)], &jacobian, &[]).unwrap();
    }
    let fit = DynPce::fit(&data, &options(4)).unwrap();
    for x in [[0.3, -0.8], [-1.0, 0.55]] {
        let found = fit.pce.value(&x).unwrap();
        assert!((found[0] - f(x[0], x[1])).abs() < 1e-12, "{found:?}");
        assert!((found[1] - g(x[0], x[1])).abs() < 1e-12, "{found:?}");
    }
    assert_eq!(fit.report.order, 4);
}
