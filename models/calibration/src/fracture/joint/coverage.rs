//! Coverage of the intervals of E, Gc and ξ from a fast and a slow test of emulated laboratories.

use std::collections::BTreeMap;

use ppl::Nuts;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, PceFit};

use super::*;
use crate::fracture::Evidence;
use crate::prior::Prior;

/// Default number of laboratories. The environment variable `BRECCIA_LABORATORIES` replaces it; 300 take some minutes.
const LABORATORIES: u64 = 24;
/// Relative standard deviation of slope, peak force and its displacement between packings.
const PACKINGS: [f64; 3] = [0.03, 0.02, 0.015];
/// Runs of the design of each test.
const RUNS: usize = 40;

fn inputs() -> Vec<Input> {
    let bounds = [("young", 230.0, 330.0), ("toughness", 0.001, 0.005), ("viscosity", 0.1, 0.55)];
    bounds.map(|(name, low, high)| Input::new(name, low, high).unwrap()).to_vec()
}

/// Slope, peak force and its displacement, relative to typical values. In the fast test, viscosity determines the peak; in
/// the slow test, toughness and viscosity do.
fn response(is_slow: bool, parameters: &[f64]) -> [f64; 3] {
    let [young, toughness, viscosity] =
        [parameters[0] / 280.0, parameters[1] / 0.0025, parameters[2] / 0.3];
    let place = match is_slow {
        false => (viscosity / young).cbrt() * toughness.powf(0.01),
        true => young.powf(-0.45) * toughness.powf(0.3) * viscosity.powf(0.13),
    };
    [young, young * place, place]
}

/// Surrogate of runs whose quantities are multiplied by `1 + PACKINGS · scatter`.
fn fitted(is_slow: bool, runs: usize, order: usize, mut scatter: impl FnMut() -> f64) -> PceFit {
    let outputs = ["slope", "peak", "place"].map(str::to_owned).to_vec();
    let mut data = Dataset::new(inputs(), outputs, "closed form").unwrap();
    let seed = u64::from(is_slow) + 1;
    for point in DesignMethod::Sobol.sample(&inputs(), runs, seed).unwrap() {
        let mut values = response(is_slow, &point);
        values.iter_mut().zip(PACKINGS).for_each(|(value, sd)| *value *= 1.0 + sd * scatter());
        data.push(&point, &values).unwrap();
    }
    DynPce::fit(&data, &FitOptions { max_order: order, ..FitOptions::default() }).unwrap()
}

/// Whether the 90 % interval of each parameter contains the truth, with the exact responses and with surrogates of few
/// runs on different packings.
fn covered(seed: u64, exact: &[DynPce; 2]) -> [[bool; 3]; 2] {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let truth: Vec<f64> = inputs()
        .iter()
        .map(|input| input.lower + (0.2 + 0.6 * rng.random::<f64>()) * (input.upper - input.lower))
        .collect();
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let mut specimens = |forward: &DynPce, count: usize| {
        let mean = forward.value(&truth).unwrap();
        let mut specimen = || {
            let material = 0.03 * normal();
            let all = mean.iter().zip(PACKINGS);
            all.map(|(mean, sd)| mean * (1.0 + material + sd * normal())).collect::<Vec<f64>>()
        };
        (0..count).map(|_| specimen()).collect::<Vec<Vec<f64>>>()
    };
    let qois = [specimens(&exact[0], 8), specimens(&exact[1], 6)];
    let fits = [false, true].map(|is_slow| fitted(is_slow, RUNS, 2, &mut normal));
    let test = |k: usize, forward: &DynPce, evidence: Evidence| JointTest {
        name: ["fast", "slow"][k].to_owned(),
        forward: forward.clone(),
        priors: Prior::uniform_on(&inputs()),
        own: Vec::new(),
        evidence: Evidence { qois: qois[k].clone(), ..evidence },
    };
    let with_exact = [0, 1].map(|k| test(k, &exact[k], Evidence::default()));
    let with_runs = [0, 1].map(|k| {
        let open = vec![fits[k].coefficients.clone()];
        test(k, &fits[k].pce, Evidence { open, ..Evidence::default() })
    });
    [with_exact, with_runs].map(|tests| {
        let sampler = Nuts::default().chains(1).warmup(300).draws(400).seed(seed).threads(1);
        let joint = calibrate_tests(&tests, &BTreeMap::new(), &sampler, 0, seed).unwrap();
        [0, 1, 2].map(|k| {
            let [low, high] = joint.posterior.interval(&format!("theta[{k}]"), 0.9).unwrap();
            (low..=high).contains(&truth[k])
        })
    })
}

/// Intervals with surrogates cover as often as intervals with the exact responses on the same laboratories.
#[test]
fn intervals_with_surrogates_cover_like_intervals_with_the_exact_responses() {
    let laboratories = std::env::var("BRECCIA_LABORATORIES").ok();
    let laboratories: u64 =
        laboratories.and_then(|count| count.parse().ok()).unwrap_or(LABORATORIES);
    let exact = [false, true].map(|is_slow| fitted(is_slow, 256, 5, || 0.0).pce);
    let all: Vec<[[bool; 3]; 2]> =
        (0..laboratories).into_par_iter().map(|seed| covered(seed, &exact)).collect();
    let n = laboratories as f64;
    for (k, parameter) in ["E", "Gc", "ξ"].into_iter().enumerate() {
        let share =
            |setting: usize| all.iter().filter(|covered| covered[setting][k]).count() as f64 / n;
        let differ = all.iter().filter(|covered| covered[0][k] != covered[1][k]).count() as f64;
        let (exact, surrogate) = (share(0), share(1));
        println!("{parameter}: exact {exact:.3}, surrogate {surrogate:.3} of {laboratories}");
        // standard error of the difference of paired shares
        let error = differ.max(1.0).sqrt() / n;
        assert!((exact - surrogate).abs() < 2.5 * error, "{parameter}: {exact} {surrogate}");
        let error = (0.9 * 0.1 / n).sqrt();
        assert!((surrogate - 0.9).abs() < 3.0 * error, "{parameter}: {surrogate} ± {error}");
    }
}
