//! Number of gradients per effective draw, without and with the gradients of the warmup, as CSV:
//! `cargo bench -p ppl --bench warmup`.
//!
//! Three presets are compared: Stan's warmup (1000 draws), the default warmup (700 draws), and the default warmup with
//! 400 draws. The number of effective draws is the smallest bulk ESS of the unconstrained coordinates, for 4 chains
//! with 1000 draws. Figures are medians over seeds. Gradients are exact counts, so that the table does not depend on
//! the machine.

#[path = "../tests/samplers/kinds.rs"]
mod kinds;
#[path = "../tests/samplers/targets.rs"]
#[allow(dead_code)] // the benchmark uses only some of the targets
mod targets;

use kinds::{EFFECTS, ERRORS, gradients_per_effective_draw};
use ppl::{LogDensity, Nuts};
use targets::Gaussian;

fn report<D: LogDensity>(target: &str, seeds: u64, density: &D) {
    let presets = [
        ("stan_1000", Nuts::stan_compatible()),
        ("default_700", Nuts::default()),
        ("default_400", Nuts::default().warmup(400)),
    ];
    for (preset, nuts) in presets {
        let mut costs: [Vec<f64>; 2] = [Vec::new(), Vec::new()];
        for seed in 1..=seeds {
            let chains = nuts.clone().seed(seed).run(density).expect("the target samples");
            for (all, one) in costs.iter_mut().zip(gradients_per_effective_draw(&chains)) {
                all.push(one);
            }
        }
        let median = |costs: &mut Vec<f64>| {
            costs.sort_by(f64::total_cmp);
            costs[costs.len() / 2]
        };
        let [sampling, all] = costs.each_mut().map(median);
        println!("{target},{preset},{sampling:.1},{all:.1}");
    }
}

fn main() {
    // `cargo test --benches` only checks that the benchmark runs
    let seeds = if std::env::args().any(|a| a == "--bench") { 15 } else { 1 };
    println!("target,preset,gradients_per_ess_sampling,gradients_per_ess_with_warmup");
    report("autoregression_d10", seeds, &Gaussian::autoregressive(10, 0.9, 0.01, 100.0));
    let (time, level) = kinds::decay_data();
    report("decay_d4", seeds, &kinds::decay(&time, &level));
    let (strain, stress) = kinds::hardening_data();
    report("hardening_d4", seeds, &kinds::hardening(&strain, &stress));
    report("logistic_collinear_d20", seeds, &kinds::logistic());
    report("eight_schools_non_centred_d10", seeds, &kinds::eight_schools(&EFFECTS, &ERRORS));
}
