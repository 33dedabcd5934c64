//! Compares runs that are placed in the posterior with a larger number of runs in the whole prior box.

use ppl::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, PceFit};

const NAMES: [&str; 3] = ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"];
const PRIOR: [[f64; 2]; 3] = [[250.0, 300.0], [1e-5, 5e-3], [0.05, 0.55]];

/// Slope, peak force and displacement at peak in the viscous limit, with a small effect of the
/// toughness.
fn exact(x: &[f64]) -> [f64; 3] {
    let place = (x[2] / x[0]).cbrt() * (1.0 + 4.0 * x[1]);
    [5.0 * x[0], 4.0 * x[0] * place, place]
}

fn inputs() -> Vec<Input> {
    let inputs = NAMES.iter().zip(PRIOR).map(|(name, [low, high])| Input::new(*name, low, high));
    inputs.collect::<Result<_, _>>().unwrap()
}

/// Runs with a separate packing each. `scatter` is the relative standard deviation between packings.
struct Laboratory {
    scatter: f64,
    rng: Xoshiro256PlusPlus,
}

impl Laboratory {
    fn run(&mut self, runs: &mut Dataset, x: &[f64]) {
        let mut unit = || -> f64 { Normal(0.0, 1.0).draw(&mut self.rng) };
        let values = exact(x).map(|value| value * (1.0 + self.scatter * unit()));
        runs.push(x, &values).unwrap();
    }

    fn uniform(&mut self, count: usize, seed: u64) -> Dataset {
        let outputs = ["slope", "peak", "at"].map(str::to_owned).to_vec();
        let mut runs = Dataset::new(inputs(), outputs, "closed form").unwrap();
        for x in DesignMethod::LatinHypercube.sample(&inputs(), count, seed).unwrap() {
            self.run(&mut runs, &x);
        }
        runs
    }
}

/// Draws of a posterior that determines E and ξ but not Gc, like the posterior of the default case.
fn posterior(rng: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
    let mut draw = || {
        let young: f64 = Normal(280.0, 5.0).truncate(250.0..300.0).draw(rng);
        let toughness: f64 = Uniform(PRIOR[1][0], PRIOR[1][1]).draw(rng);
        vec![young, toughness, Normal(0.3, 0.01).draw(rng)]
    };
    (0..300).map(|_| draw()).collect()
}

fn fitted(runs: &Dataset) -> PceFit {
    DynPce::fit(runs, &FitOptions { max_order: 4, ..FitOptions::default() }).unwrap()
}

/// Root mean square of the relative error over the posterior and the quantities.
fn error(fit: &PceFit, places: &[Vec<f64>]) -> f64 {
    let of = |x: &Vec<f64>| {
        let found = fit.pce.value(x).unwrap();
        found.iter().zip(exact(x)).map(|(a, b)| (a / b - 1.0).powi(2)).sum::<f64>() / 3.0
    };
    (places.iter().map(of).sum::<f64>() / places.len() as f64).sqrt()
}

/// Geometric mean of the ratios of the errors `b` to the errors `a`, and the distance of this mean from 1 in standard
/// errors.
fn beside(a: &[f64], b: &[f64]) -> (f64, f64) {
    let n = a.len() as f64;
    let gaps: Vec<f64> = a.iter().zip(b).map(|(a, b)| (b / a).ln()).collect();
    let mean = gaps.iter().sum::<f64>() / n;
    let spread = gaps.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean.exp(), mean / (spread / n).sqrt())
}

/// In forty laboratories, 24 runs in the box and 24 runs in batches of eight, with a separate packing each, are
/// compared with uniform runs: batches improve the surrogate, and placed runs are at least as good as uniform runs.
#[test]
fn placed_runs_are_worth_as_many_uniform_ones() {
    const COUNTS: [usize; 4] = [24, 48, 96, 144];
    let (mut placed, mut uniform) = (Vec::new(), vec![Vec::new(); COUNTS.len()]);
    for seed in 0..40 {
        let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut laboratory = Laboratory { scatter: 0.02, rng };
        let places = posterior(&mut laboratory.rng);
        let mut runs = laboratory.uniform(24, seed);
        uniform[0].push(error(&fitted(&runs), &places));
        for _ in 0..3 {
            let fit = fitted(&runs);
            for at in fit.coefficients.placement(&places, 8).unwrap() {
                laboratory.run(&mut runs, &places[at]);
            }
        }
        placed.push(error(&fitted(&runs), &places));
        for (errors, count) in uniform.iter_mut().zip(COUNTS).skip(1) {
            errors.push(error(&fitted(&laboratory.uniform(count, 1000 + seed)), &places));
        }
    }
    let scores: Vec<f64> = uniform.iter().map(|errors| beside(&placed, errors).1).collect();
    for (errors, count) in uniform.iter().zip(COUNTS) {
        let (ratio, score) = beside(&placed, errors);
        println!(
            "{count} uniform: {ratio:.2} times the error of 24 + 24 placed, {score:.1} standard errors off 1"
        );
    }
    assert!(scores[0] > 4.0 && scores[1] > -4.0, "{scores:?}");
}
