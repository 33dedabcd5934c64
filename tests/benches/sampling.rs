//! `cargo bench -p breccia-tests --bench sampling`: processor time of the paper's model (9
//! parameters, 8 experiments) and of eight schools, as CSV `model,dim,quantity,value,unit`.
//!
//! Value and gradient are medians over batches at points near the mode; the overhead is the time
//! of a sampling run less its gradients, by leapfrog.

use std::hint::black_box;
use std::time::Instant;

use breccia_tests::{Instance, eight_schools};
use models::calibration;
use ppl::prelude::*;
use ppl::{Bound, Model, Nuts, Workspace};

fn main() {
    // `cargo test --benches` only wants to know that it runs
    let quick = !std::env::args().any(|a| a == "--bench");
    println!("model,dim,quantity,value,unit");
    let instance = Instance::load();
    let prior = Instance::prior();
    report("paper_calibration", &calibration(&instance.pce, &instance.qois, &prior), quick);
    let (y, se) = (eight_schools::EFFECT, eight_schools::ERROR);
    report("eight_schools_non_centred", &eight_schools::non_centred(&y, &se), quick);
}

fn report<M: Model>(name: &str, model: &Bound<M>, quick: bool) {
    let dim = model.dim();
    let line = |quantity: &str, value: f64, unit: &str| {
        println!("{name},{dim},{quantity},{value:.4},{unit}");
    };
    let points: Vec<Vec<f64>> = (0..16)
        .map(|k| (0..dim).map(|i| 0.3 * f64::from((7 * i as i32 + 5 * k) % 11 - 5) / 5.0).collect())
        .collect();
    let (batches, repeats) = if quick { (1, 2) } else { (41, 2000) };
    let mut workspace = Workspace::default();
    let value = median_ns(batches, repeats, |k| {
        black_box(model.log_density(&points[k % 16], &mut workspace)).is_ok()
    });
    line("value", value, "ns");
    let mut gradient = vec![0.0; dim];
    let full = median_ns(batches, repeats, |k| {
        black_box(model.gradient(&points[k % 16], &mut gradient, &mut workspace)).is_ok()
    });
    line("gradient", full, "ns");

    let draws = if quick { 20 } else { 20_000 };
    let sampler = Nuts::default().chains(1).threads(1).warmup(500).draws(draws).seed(1);
    let start = Instant::now();
    let chains = sampler.run(model).expect("the model samples");
    let seconds = start.elapsed().as_secs_f64();
    let chain = &chains.chains[0];
    let leapfrogs: u32 = chain.stats.iter().chain(&chain.warmup.stats).map(|s| s.leapfrogs).sum();
    let each = seconds * 1e9 / f64::from(leapfrogs);
    line("leapfrog", each / 1000.0, "us");
    line("overhead_per_leapfrog", (each - full) / 1000.0, "us");
}

/// Median over batches of the mean time of one call, in ns.
fn median_ns(batches: usize, repeats: usize, mut call: impl FnMut(usize) -> bool) -> f64 {
    let mut times: Vec<f64> = (0..batches)
        .map(|_| {
            let start = Instant::now();
            for k in 0..repeats {
                assert!(call(k));
            }
            start.elapsed().as_secs_f64() * 1e9 / repeats as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[batches / 2]
}
