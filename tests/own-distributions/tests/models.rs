//! Tests the three distributions in models: conformance, gradients, and posteriors in closed form.

use own_distributions::{Geometric, Laplace, RandomWalk};
use ppl::check;
use ppl::prelude::*;
use ppl::rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn laplace(y: &[f64]) {
        let location ~ Laplace(0.0, 3.0);
        let scale ~ HalfNormal(2.0);
        for y in y {
            y ~ Laplace(location, scale);
        }
    }

    fn geometric(failures: &[u64]) {
        let p ~ Beta(2.0, 3.0);
        for k in failures {
            k ~ Geometric(p);
        }
        #[predict] let next ~ Geometric(p);
    }

    fn walk(seen: &[f64]) {
        let x ~ RandomWalk { length: seen.len(), step_sd: 1.0 };
        for (x, seen) in x.iter().zip(seen) {
            seen ~ Normal(*x, 0.5);
        }
    }

    fn walk_of_unknown_step(path: &[f64]) {
        let sd ~ HalfNormal(1.0);
        path ~ RandomWalk { length: path.len(), step_sd: sd };
    }
}

#[test]
fn laplace_in_a_model() {
    check::gradient(&laplace(&[0.4, -1.0, 2.5]), 1);
}

#[test]
fn probabilities_of_counts_sum_to_one() {
    let mass = |k: u64| {
        let ln_mass: f64 = Geometric(0.1).ln_density(&k);
        ln_mass.exp()
    };
    let sum: f64 = (0..400).map(mass).sum();
    assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let draw = |_| -> u64 { Distribution::<f64>::draw(&Geometric(0.1), &mut rng) };
    let total: u64 = (0..20_000).map(draw).sum();
    // expectation 9, standard deviation √90 of one draw
    assert!((total as f64 / 20_000.0 - 9.0).abs() < 4.0 * (90.0f64 / 20_000.0).sqrt());
}

/// Beta(2, 3) and n geometric counts with sum s have the posterior Beta(2 + n, 3 + s).
#[test]
fn the_conjugate_posterior_of_counts() {
    let failures = [3, 0, 7, 2, 5, 1];
    let model = geometric(&failures);
    check::gradient(&model, 2);
    let posterior = Nuts::default().chains(2).seed(3).sample(&model).expect("a posterior");
    let row = posterior.summary();
    let row = row.row("p").expect("an unknown");
    let (a, b) = (8.0, 21.0);
    assert!((row.mean - a / (a + b)).abs() < 4.0 * row.mcse_mean, "{}", row.mean);
    let variance: f64 = a * b / ((a + b) * (a + b) * (a + b + 1.0));
    assert!((row.sd / variance.sqrt() - 1.0).abs() < 0.1, "{}", row.sd);
}

/// The random walk and its noisy data are jointly normal: the posterior mean solves a tridiagonal system.
#[test]
fn the_normal_posterior_of_a_walk() {
    let seen = [0.4, 1.9];
    let model = walk(&seen);
    check::gradient(&model, 4);
    check::gradient(&walk_of_unknown_step(&[0.3, 0.1, -0.8]), 5);
    let posterior = Nuts::default().chains(2).seed(5).sample(&model).expect("a posterior");
    // the precision matrix is [[2 + 4, −1], [−1, 1 + 4]], and the right-hand side is 4 · seen
    let determinant = 6.0 * 5.0 - 1.0;
    let (first, second) = (4.0 * seen[0], 4.0 * seen[1]);
    let mean = [(5.0 * first + second) / determinant, (first + 6.0 * second) / determinant];
    let summary = posterior.summary();
    for (i, mean) in mean.into_iter().enumerate() {
        let row = summary.row(&format!("x[{i}]")).expect("an unknown");
        assert!((row.mean - mean).abs() < 4.0 * row.mcse_mean, "{} instead of {mean}", row.mean);
    }
}
