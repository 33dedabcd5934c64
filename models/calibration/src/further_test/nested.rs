//! Checks the expected contraction of a further test against nested Monte Carlo: truths are drawn from the present
//! posterior, data of a test are emulated at each truth, and Bayes' theorem gives the posterior after these data.

use ppl::prelude::*;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// Number of truths.
const TRUTHS: usize = 3000;

/// Estimated contraction with its standard error.
struct Nested {
    contraction: f64,
    error: f64,
}

/// Estimates the contraction 1 − E[(θ − E[θ | y])²]/(prior variance) of one parameter by nested Monte Carlo. Each truth
/// θ gives data y ~ N(f(θ), C). The posterior mean given y is the mean of the other draws, weighted by the density of y
/// at each draw.
fn nested(
    prior: [f64; 2],
    parameter: usize,
    draws: &[Vec<f64>],
    quantities: &dyn Fn(&[f64]) -> Vec<f64>,
    covariance: &[Vec<f64>],
) -> Nested {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let factor = DynCholeskyFactor::of_covariance(covariance).unwrap();
    let (truths, others) = draws.split_at(TRUTHS);
    // whitened, so that the components of the data are independent with unit variance
    let whitened = |x: &Vec<f64>| factor.solve_lower(&quantities(x)).unwrap();
    let others_whitened: Vec<Vec<f64>> = others.iter().map(whitened).collect();
    let variance = (prior[1] - prior[0]).powi(2) / 12.0;
    let mut losses = Vec::new();
    for truth in truths {
        let mut noise = || -> f64 { Normal(0.0, 1.0).draw(&mut rng) };
        let y: Vec<f64> = whitened(truth).iter().map(|m| m + noise()).collect();
        let square = |m: &Vec<f64>| m.iter().zip(&y).map(|(m, y)| (m - y).powi(2)).sum::<f64>();
        let weights: Vec<f64> = others_whitened.iter().map(|m| (-0.5 * square(m)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let mean = weights.iter().zip(others).map(|(w, x)| w * x[parameter]).sum::<f64>() / sum;
        losses.push((truth[parameter] - mean).powi(2) / variance);
    }
    let n = losses.len() as f64;
    let loss = losses.iter().sum::<f64>() / n;
    let spread = losses.iter().map(|l| (l - loss).powi(2)).sum::<f64>() / (n - 1.0);
    Nested { contraction: 1.0 - loss, error: (spread / n).sqrt() }
}

/// For a linear response and normal distributions, the expected contraction agrees with nested Monte Carlo within 4
/// standard errors.
#[test]
fn a_normal_belief_is_contracted_as_emulated_data_do_it() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let prior = [[250.0, 300.0], [0.05, 0.55]];
    let mut normal = || -> f64 { Normal(0.0, 1.0).draw(&mut rng) };
    // two correlated parameters
    let draws: Vec<Vec<f64>> = (0..TRUTHS + 4000)
        .map(|_| {
            let (a, b) = (normal(), normal());
            vec![277.0 + 8.0 * a, 0.3 + 0.03 * a - 0.05 * b]
        })
        .collect();
    let belief = Belief::of_draws(&prior.map(|[a, b]| Prior::uniform(a, b)), &draws).unwrap();
    let jacobian = vec![vec![0.0024, 1.1], vec![-0.0012, 1.2]];
    let scatter = vec![vec![64e-4, 20e-4], vec![20e-4, 49e-4]];
    let shared = vec![vec![1e-4, 0.0], vec![0.0, 2e-4]];
    let test = FurtherTest {
        draws: vec![TestAtDraw { jacobian: jacobian.clone(), scatter: scatter.clone() }],
        shared: shared.clone(),
        seen: Vec::new(),
        alike: None,
    };
    let quantities = |x: &[f64]| -> Vec<f64> {
        jacobian.iter().map(|row| row[0] * x[0] + row[1] * x[1]).collect()
    };
    for specimens in [1, 6] {
        let entry = |m: usize, n: usize| scatter[m][n] / specimens as f64 + shared[m][n];
        let covariance: Vec<Vec<f64>> =
            (0..2).map(|m| (0..2).map(|n| entry(m, n)).collect()).collect();
        let expected = test.expected(&belief, specimens).unwrap();
        for (i, expected) in expected.iter().enumerate() {
            let estimate = nested(prior[i], i, &draws, &quantities, &covariance);
            let gap = (expected.contraction - estimate.contraction).abs();
            assert!(gap < 4.0 * estimate.error, "{specimens} {i}: {gap} ± {}", estimate.error);
            let gained = expected.contraction - belief.now()[i].contraction;
            assert!(
                gained > 8.0 * estimate.error || i == 0,
                "the test has hardly any information: {gained}"
            );
        }
    }
}

/// The posterior of the toughness Gc fills the prior's box. The peak force of a slow test is proportional to √(E Gc),
/// as in a homogeneous body without viscosity. The linear and normal approximation at each draw underestimates the contraction, because a box
/// has no tails, but by less than 0.06.
#[test]
fn a_belief_that_fills_its_box_is_contracted_a_little_more_than_is_promised() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let prior = [[250.0, 300.0], [1e-5, 5e-3]];
    let draws: Vec<Vec<f64>> = (0..TRUTHS + 4000)
        .map(|_| {
            let young: f64 = Normal(280.0, 5.0).draw(&mut rng);
            vec![young, Uniform(prior[1][0], prior[1][1]).draw(&mut rng)]
        })
        .collect();
    let belief = Belief::of_draws(&prior.map(|[a, b]| Prior::uniform(a, b)), &draws).unwrap();
    let ln_peak = |x: &[f64]| vec![0.5 * (x[0] * x[1]).ln()];
    for (scatter, specimens) in [(0.3, 1), (0.3, 4), (0.1, 1), (0.1, 4)] {
        let at = |x: &Vec<f64>| TestAtDraw {
            jacobian: vec![vec![0.5 / x[0], 0.5 / x[1]]],
            scatter: vec![vec![scatter * scatter]],
        };
        let test = FurtherTest {
            draws: draws.iter().step_by(10).map(at).collect(),
            shared: vec![vec![0.0]],
            seen: Vec::new(),
            alike: None,
        };
        let promised = test.expected(&belief, specimens).unwrap()[1].contraction;
        let covariance = [vec![scatter * scatter / specimens as f64]];
        let estimate = nested(prior[1], 1, &draws, &ln_peak, &covariance);
        let more = estimate.contraction - promised;
        let text = format!(
            "{scatter} {specimens}: {promised} {} ± {}",
            estimate.contraction, estimate.error
        );
        assert!(more > -4.0 * estimate.error && more < 0.06 + 4.0 * estimate.error, "{text}");
    }
}
