//! Predicts the yield stresses of 304L steel at a strain rate from the yield stresses at the other four rates.
//!
//! ```text
//! cargo run --release -p models --example steel_rates [validation.csv]
//! ```
//! The rate tests of `steel_304l.rs`, without its bars: the yield stress at a rate is a closed form, so that nothing is
//! simulated. Each of the five rates is held out once. The table compares predictions and measurements in the form of
//! `[[validation]]` (docs/how-to/validation.md).

use std::f64::consts::LN_10;
use std::path::Path;

use models::calibration::{HeldOutScores, HeldOutValue, Prediction};
use models::viscoplastic::{RateTest, VoceJohnsonCook, read_rate_tests};
use ppl::prelude::*;

type Error = Box<dyn std::error::Error>;

/// Number of draws between two draws that a prediction uses.
const THIN: usize = 8;

/// Returns the factor of the yield stress at a rate, for log₁₀ C. Hardening has no effect on the yield stress.
fn rate_factor<S: Scalar>(log10_c: S, rate_per_s: f64) -> S {
    let c = (log10_c * LN_10).exp();
    let one = c * 0.0 + 1.0;
    let law = VoceJohnsonCook {
        yield_mpa: one,
        saturation_mpa: one,
        rate: one,
        c,
        reference_per_s: 1e-5,
    };
    law.rate_factor(rate_per_s)
}

ppl::model! {
    /// Rate tests with the priors of `steel_304l.rs`.
    pub fn yield_at_rates(rates: &[RateTest]) {
        let yield_mpa ~ Uniform(205.0, 265.0);
        let offset_factor ~ Uniform(0.5, 1.75);
        let log10_c ~ Uniform(-1.7, -1.1);
        let rate_scatter ~ HalfNormal(0.2);
        for test in rates {
            let expected = offset_factor * yield_mpa * rate_factor(log10_c, test.rate_per_s);
            test.yield_mpa ~ LogNormal(expected.ln(), rate_scatter);
        }
    }
}

/// Predicts the logarithm of the yield stress at a rate from tests at other rates.
pub fn predicted(seen: &[RateTest], rate_per_s: f64) -> Result<Prediction, Error> {
    let sampler = Nuts::default().chains(4).draws(1000).target_accept(0.95).seed(1);
    let posterior = sampler.sample(&yield_at_rates(seen))?;
    let rhat = posterior.summary().rows.iter().map(|row| row.rhat).fold(1.0, f64::max);
    println!("{rate_per_s} 1/s: largest R-hat {rhat:.3}");
    let draws = |name: &str| -> Vec<f64> {
        let all = posterior.trace(name).unwrap_or_default().concat();
        all.into_iter().step_by(THIN).collect()
    };
    let (stress, factor, log10_c) = (draws("yield_mpa"), draws("offset_factor"), draws("log10_c"));
    let mean = |k: usize| (stress[k] * factor[k] * rate_factor(log10_c[k], rate_per_s)).ln();
    let means = (0..stress.len()).map(mean).collect();
    Ok(Prediction::new(means, draws("rate_scatter"), 0.0)?)
}

fn main() -> Result<(), Error> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/matcal_304L_rate_yield.csv");
    let tests = read_rate_tests(&data)?;
    let mut rates: Vec<f64> = tests.iter().map(|test| test.rate_per_s).collect();
    rates.sort_by(f64::total_cmp);
    rates.dedup();
    let mut predictions = Vec::new();
    for &rate in &rates {
        let (new, seen): (Vec<_>, Vec<_>) = tests.iter().partition(|test| test.rate_per_s == rate);
        predictions.push((format!("{rate} 1/s"), new, predicted(&seen, rate)?));
    }
    println!(
        "\nthe rate that was not seen: tests inside 50 % and 90 %, CRPS, difference of the means"
    );
    let ids: Vec<String> = (1..=tests.len()).map(|k| k.to_string()).collect();
    let mut all = Vec::new();
    for (name, new, prediction) in &predictions {
        let mut values = Vec::new();
        for (specimen, test) in ids.iter().zip(new) {
            let (validation, quantity) = (name.as_str(), "ln_yield_MPa");
            let measured = test.yield_mpa.ln();
            values.push(HeldOutValue { validation, quantity, specimen, measured, prediction });
        }
        let measured: Vec<f64> = values.iter().map(|value| value.measured).collect();
        let deviation = prediction.deviation(&measured);
        let scores = HeldOutScores::of(&values);
        println!(
            "{name}: {} and {} of {}, mean CRPS {:.4}, {:+.1} %, p = {:.3}",
            scores.inside50.inside,
            scores.inside90.inside,
            scores.inside90.total,
            scores.mean_crps,
            100.0 * deviation.difference,
            deviation.p_value().unwrap_or(f64::NAN)
        );
        all.extend(values);
    }
    let scores = HeldOutScores::of(&all);
    let intervals = [scores.inside50, scores.inside90].map(|coverage| coverage.interval(0.95));
    println!(
        "all: {} and {} of {} inside; with 95 % confidence {intervals:.2?}; mean CRPS {:.4}",
        scores.inside50.inside, scores.inside90.inside, scores.inside90.total, scores.mean_crps
    );
    let table = std::env::args().nth(1).unwrap_or_else(|| "validation.csv".to_owned());
    std::fs::write(&table, HeldOutValue::csv(&all))?;
    println!("{table}");
    Ok(())
}
