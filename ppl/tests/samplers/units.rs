//! Posteriors do not depend on the unit of the data: NUTS with data of size 1 and of size 1e-12.

use ppl::check::Estimate;
use ppl::diagnostics::{mcse_mean, mcse_sd};
use ppl::prelude::*;
use ppl::{Bound, Model, Posterior};

ppl::model! {
    /// Lives of parts in a test that ends at `end`, gamma-distributed with unknown shape and mean.
    fn lives(lives: &[f64], end: f64, unit: f64) {
        let shape ~ LogNormal(0.5, 0.5);
        let mean ~ Normal(3.0 * unit, 1.5 * unit).truncate(0.0..);
        for life in lives {
            life ~ Gamma(shape, shape / mean).censor(..end);
        }
    }

    /// Measured lengths with an unknown systematic error, whose coordinate has the unit of the data.
    fn lengths(measured: &[f64], unit: f64) {
        let error ~ Normal(0.0, unit);
        let sd ~ HalfNormal(unit);
        for y in measured {
            y ~ Normal(error, sd);
        }
    }
}

const LIVES: [f64; 10] = [0.4, 5.0, 1.7, 2.9, 5.0, 0.9, 3.8, 2.2, 5.0, 1.3];
const MEASURED: [f64; 6] = [0.31, -0.12, 0.45, 0.02, 0.28, 0.19];

fn sample<M: Model>(model: &Bound<M>) -> Posterior {
    Nuts::default().chains(4).seed(5).sample(model).expect("runs")
}

/// Compares mean and standard deviation of a number, whose draws are `scale` times larger in `large` than in `small`.
fn assert_same([large, small]: [&Posterior; 2], name: &str, scale: f64) {
    let scaled = |posterior: &Posterior, scale: f64| -> Vec<Vec<f64>> {
        let chains = posterior.trace(name).expect("an unknown").into_iter();
        chains.map(|chain| chain.into_iter().map(|x| x * scale).collect()).collect()
    };
    let [large, small] = [scaled(large, 1.0), scaled(small, scale)];
    let [large, small] = [&large, &small].map(|chains| chains.iter().map(Vec::as_slice));
    let [large, small] = [large.collect::<Vec<_>>(), small.collect::<Vec<_>>()];
    let draws = large.concat();
    let mean = draws.iter().sum::<f64>() / draws.len() as f64;
    let squares: f64 = draws.iter().map(|x| (x - mean).powi(2)).sum();
    let sd = (squares / (draws.len() - 1) as f64).sqrt();
    let error = mcse_mean(&large);
    Estimate::of_mean(name, &small, mean).reference_error(error).within_mcse(4.0);
    Estimate::of_sd(name, &small, sd).reference_error(mcse_sd(&large)).within_mcse(4.0);
}

#[test]
fn censored_lives_in_tiny_units() {
    let tiny = 1e-12;
    let in_tiny = LIVES.map(|life| life * tiny);
    let large = sample(&lives(&LIVES, 5.0, 1.0));
    let small = sample(&lives(&in_tiny, in_tiny[1], tiny));
    assert_same([&large, &small], "shape", 1.0);
    assert_same([&large, &small], "mean", 1.0 / tiny);
}

#[test]
fn coordinates_in_tiny_units() {
    let tiny = 1e-12;
    let large = sample(&lengths(&MEASURED, 1.0));
    let small = sample(&lengths(&MEASURED.map(|y| y * tiny), tiny));
    assert_same([&large, &small], "error", 1.0 / tiny);
    assert_same([&large, &small], "sd", 1.0 / tiny);
}
