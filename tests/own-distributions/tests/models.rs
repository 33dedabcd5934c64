//! Tests the four distributions in models: conformance, gradients, and posteriors in closed form or by quadrature.

use own_distributions::{Geometric, Laplace, Logistic, RandomWalk};
use ppl::check;
use ppl::prelude::*;
use ppl::rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

ppl::model! {
    fn laplace(y: &[f64]) {
        let location ~ Laplace(0.0, 3.0);
        let scale ~ HalfNormal(2.0);
        for y in y {
            y ~ Laplace(location, scale);
        }
    }

    /// Values above 0 of a logistic distribution, and readings of an instrument that reports at most 3.
    fn logistic(above: &[f64], read: &[f64]) {
        let location ~ Normal(0.0, 2.0);
        for x in above {
            x ~ Logistic(location, 1.0).truncate(0.0..);
        }
        for reading in read {
            reading ~ Logistic(location, 1.0).censor(..3.0);
        }
    }

    fn logistic_of_unknown_scale(above: &[f64], read: &[f64]) {
        let location ~ Logistic(0.0, 1.0).truncate(-2.0..2.0);
        let scale ~ HalfNormal(1.0);
        for x in above {
            x ~ Logistic(location, scale).truncate(0.0..);
        }
        for reading in read {
            reading ~ Logistic(location, scale).censor(..3.0);
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

/// Random bits that begin with a given word: the uniform numbers nearest to 0 or 1.
struct FirstWord {
    word: Option<u64>,
    rest: Xoshiro256PlusPlus,
}

impl RngCore for FirstWord {
    fn next_u32(&mut self) -> u32 {
        self.next_u64() as u32
    }

    fn next_u64(&mut self) -> u64 {
        self.word.take().unwrap_or_else(|| self.rest.next_u64())
    }

    fn fill_bytes(&mut self, dst: &mut [u8]) {
        self.rest.fill_bytes(dst);
    }
}

/// The logarithm of a uniform number of 0 would be infinite.
#[test]
fn draws_at_the_ends_of_the_uniform_numbers_are_finite() {
    for word in [0, u64::MAX] {
        let rng = || FirstWord { word: Some(word), rest: Xoshiro256PlusPlus::seed_from_u64(1) };
        let laplace: f64 = Distribution::<f64>::draw(&Laplace(0.0, 2.0), &mut rng());
        let logistic: f64 = Distribution::<f64>::draw(&Logistic(0.0, 2.0), &mut rng());
        for draw in [laplace, logistic] {
            // 2 · 53 ln 2 = 73.5
            assert!(draw.abs() < 80.0, "{draw}");
        }
        let count: u64 = Distribution::<f64>::draw(&Geometric(0.1), &mut rng());
        assert!(count < 400, "{count}");
    }
}

/// The truncated density is p(x)/S(0), and the probability of a censored reading is S(3).
#[test]
fn a_logistic_distribution_is_truncated_and_censored() {
    check::assert_distribution!([m, s] Logistic(m, s), [0.4, 1.3], [-3.0, 0.2, 6.0]);
    check::assert_distribution!(
        [m, s] Logistic(m, s).truncate(0.0..4.0), [0.4, 1.3], [0.1, 0.9, 3.0]);
    check::gradient(&logistic(&[0.5, 1.2], &[2.0, 3.0]), 1);
    check::gradient(&logistic_of_unknown_scale(&[0.5, 1.2], &[2.0, 3.0]), 1);

    let (above, read) = ([0.3, 1.1, 0.2, 2.5], [1.4, 3.0]);
    let posterior =
        Nuts::default().chains(2).seed(3).sample(&logistic(&above, &read)).expect("a posterior");
    // moments by the trapezoidal rule over locations, with a density written without ppl
    let sf = |z: f64| 1.0 / (1.0 + z.exp());
    let density = |m: f64| {
        let pdf = |x: f64| sf(x - m) * sf(m - x);
        let truncated: f64 = above.iter().map(|x| pdf(*x) / sf(-m)).product();
        (-m * m / 8.0).exp() * truncated * pdf(read[0]) * sf(3.0 - m)
    };
    let moment = |power: i32| -> f64 {
        (-2000..=2000).map(|k| 0.01 * f64::from(k)).map(|m| m.powi(power) * density(m)).sum()
    };
    let mean = moment(1) / moment(0);
    let sd = (moment(2) / moment(0) - mean * mean).sqrt();
    check::mean(&posterior, "location", mean).within_mcse(4.0);
    check::sd(&posterior, "location", sd).within_mcse(4.0);
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
