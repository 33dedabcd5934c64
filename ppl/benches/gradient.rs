//! Nanoseconds per log density and per gradient, as CSV: `cargo bench -p ppl --bench gradient`.
//!
//! Medians of repeated timings; `cargo test --benches` runs everything once.

use std::hint::black_box;
use std::time::Instant;

use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

ppl::model! {
    fn eight_schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        #[track] let theta = z.map(|z| mu + tau * z);
        for j in 0..8 {
            effects[j] ~ Normal(theta[j], errors[j]);
        }
    }

    fn regression<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.5).array::<D>();
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = slope[0] * row[0];
            for d in 1..D {
                mean += slope[d] * row[d];
            }
            y ~ Normal(mean, sd);
        }
    }
}

/// Median nanoseconds of `f`, over batches long enough for the clock.
fn time(quick: bool, mut f: impl FnMut()) -> f64 {
    let (repeats, nanoseconds) = if quick { (1, 0) } else { (41, 2_000_000) };
    let mut batch = 1;
    let mut run = |batch: u32| {
        let start = Instant::now();
        (0..batch).for_each(|_| f());
        start.elapsed()
    };
    while run(batch).as_nanos() < nanoseconds {
        batch *= 2;
    }
    let mut times: Vec<f64> =
        (0..repeats).map(|_| run(batch).as_secs_f64() * 1e9 / f64::from(batch)).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn report(name: &str, quick: bool, model: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let y = model.draw_prior(&mut rng).expect("a proper model").unconstrained;
    let (mut w, mut gradient) = (Workspace::default(), vec![0.0; y.len()]);
    let value = time(quick, || {
        black_box(model.log_density(black_box(&y), &mut w).ok());
    });
    let both = time(quick, || {
        black_box(model.gradient(black_box(&y), &mut gradient, &mut w).ok());
    });
    println!("{name},{},{value:.1},{both:.1}", y.len());
}

fn main() {
    let quick = !std::env::args().any(|argument| argument == "--bench");
    println!("model,dim,value_ns,gradient_ns");
    report("eight_schools_non_centred", quick, &eight_schools(&EFFECTS, &ERRORS));
    for n in [20, 200, 2000] {
        let wave = |i: usize, d: usize| (1.0 + i as f64 * (0.7 + d as f64)).sin();
        let x: Vec<[f64; 5]> = (0..n).map(|i| std::array::from_fn(|d| wave(i, d))).collect();
        let y: Vec<f64> = x.iter().map(|row| row.iter().sum::<f64>() + 0.1 * row[0]).collect();
        report(&format!("linear_regression_n{n}"), quick, &regression(&x, &y));
    }
}
