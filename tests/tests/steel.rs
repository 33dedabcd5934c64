//! The calibration of 304L steel in `models/examples/steel_304l.rs` on synthetic tests with a known truth. The closed form of a
//! bar that does not neck replaces the simulations.

use std::array::from_fn;

use models::viscoplastic::{RateTest, UniformBar};
use ppl::check;
use ppl::prelude::*;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, FitOptions, Input, Pce, Scales};

#[path = "../../models/examples/steel_304l.rs"]
#[allow(dead_code, unreachable_pub)] // the test uses only the model and the law of the example
mod steel_304l;

use steel_304l::{M, NAMES, RANGES, STRAINS, law, steel};

/// True unknowns: yield stress, rise up to 0.3 of plastic strain (MPa), rate of hardening, log10 C.
const TRUTH: [f64; 4] = [236.0, 470.0, 1.45, -1.38];
/// True ratio of the offset yield to the yield stress of the law.
const FACTOR: f64 = 0.96;
const RATES_PER_S: [f64; 5] = [1e-4, 1e-2, 500.0, 1800.0, 3600.0];

/// Returns the logarithms of the quantities of a bar that does not neck.
fn uniform(x: [f64; 4]) -> [f64; M] {
    let bar = UniformBar { young_mpa: 199_950.0, rate_per_s: 2e-4 / 0.75 };
    let strains = (0..=400).map(|k| 0.005 * f64::from(k));
    bar.curve(&law(x), strains).quantities(&STRAINS).unwrap().map(f64::ln)
}

/// Returns the surrogate of the bar that does not neck, and its errors.
fn surrogate() -> (Pce<4, M>, [f64; M]) {
    let input = |(name, [low, high]): (&&str, [f64; 2])| Input::new(*name, low, high).unwrap();
    let inputs: Vec<Input> = NAMES.iter().zip(RANGES).map(input).collect();
    let outputs = (0..M).map(|k| format!("quantity_{k}")).collect();
    let points = DesignMethod::Sobol.sample(&inputs, 64, 1).unwrap();
    let mut runs = Dataset::new(inputs, outputs, "bar that does not neck").unwrap();
    for x in points {
        runs.push(&x, &uniform([x[0], x[1], x[2], x[3]])).unwrap();
    }
    let options = FitOptions { max_order: 4, scales: Scales::Linear, ..FitOptions::default() };
    let fit = Pce::<4, M>::fit(&runs, &options).unwrap();
    let lack = fit.report.lack_of_fit(&[1.0; M]).unwrap();
    (fit.pce, from_fn(|k| lack[k][k].sqrt()))
}

/// Draws the logarithms of the quantities of eight bars, with 0.6 % of common scatter and 0.4 % of scatter in each quantity,
/// and 64 rate tests with 8 % of scatter.
fn synthetic(seed: u64) -> (Vec<[f64; M]>, Vec<RateTest>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || -> f64 { Normal(0.0, 1.0).draw(&mut rng) };
    let truth = uniform(TRUTH);
    let mut bars = Vec::new();
    for _ in 0..8 {
        let common = 0.006 * normal();
        bars.push(from_fn(|k| truth[k] + common + 0.004 * normal()));
    }
    let mut rates = Vec::new();
    for k in 0..64 {
        let rate_per_s = RATES_PER_S[k % 5];
        let expected = FACTOR * TRUTH[0] * law(TRUTH).rate_factor(rate_per_s);
        rates.push(RateTest { rate_per_s, yield_mpa: expected * (0.08 * normal()).exp() });
    }
    (bars, rates)
}

#[test]
fn the_model_recovers_the_truth_of_synthetic_tests() {
    let (bars, rates) = synthetic(3);
    let (forward, errors) = surrogate();
    println!("errors of the surrogate {errors:.5?}");
    let model = steel(&bars, &forward, &errors, &rates);
    check::gradient(&model, 1);
    let sampler = Nuts::default().chains(4).warmup(600).draws(600).target_accept(0.9).seed(5);
    let posterior = sampler.sample(&model).unwrap();
    let summary = posterior.summary();
    println!("{summary}");
    let saturation = law(TRUTH).saturation_mpa;
    let truths = [
        ("yield_mpa", TRUTH[0]),
        ("saturation_mpa", saturation),
        ("rate", TRUTH[2]),
        ("c", 10f64.powf(TRUTH[3])),
        ("offset_factor", FACTOR),
    ];
    for (name, truth) in truths {
        let (found, sd) = (posterior.mean(name).unwrap(), posterior.sd(name).unwrap());
        let row = summary.row(name).unwrap();
        assert!((found - truth).abs() < 3.0 * sd, "{name}: {found} ± {sd}, true value {truth}");
        assert!(row.rhat < 1.03, "{name}: R-hat {}", row.rhat);
    }
    // the tests determine the yield stress to a few per cent and C to a fifth
    assert!(posterior.sd("yield_mpa").unwrap() < 0.04 * TRUTH[0]);
    assert!(posterior.sd("c").unwrap() < 0.2 * 10f64.powf(TRUTH[3]));
}
