//! Measures sampling speed: `cargo bench -p breccia-tests --bench sampling`.
//!
//! Models: the paper's calibration (9 parameters, 8 experiments; with fixed sizes, and as `models` ships it), eight schools, kidscore (434 children), radon (919
//! houses), garch11 (200 values), counts with a Gaussian process (11 counts), a mixture of two normals (1000 values)
//! and Lotka–Volterra (21 years of two species). The output is CSV: `model,dim,quantity,value,unit`. All times are
//! processor times, except in `paper_setting`.
//!
//! - `value`, `gradient`: time of one evaluation, the smallest of many batches, at points near the mode.
//! - `leapfrog`: time of a sampling run divided by its number of leapfrog steps; `overhead_per_leapfrog`: the same time
//!   without the gradient.
//! - `min_ess_bulk_per_second`: bulk ESS of the coordinate with the smallest ESS, for 4 × 2000 draws, divided by the
//!   time of the run including the default warmup. The value is the median of nine seeds; the values of the seeds
//!   differ by a third. Lotka–Volterra starts from its mode.
//! - `paper_setting`: elapsed time of 4 × 52 000 draws on two threads.
//!
//! Arguments after `--` select the models whose names contain an argument.

use std::hint::black_box;
use std::time::{Duration, Instant};

use breccia_tests::fixed_size::calibration;
use breccia_tests::posteriors::hierarchy::{houses, radon_hierarchical};
use breccia_tests::posteriors::process::{
    PredatorPrey, gp_data, gp_pois_regr, lotka_volterra, lynx_hare_data,
};
use breccia_tests::posteriors::regression::{Kidiq, kidscore};
use breccia_tests::posteriors::series::{garch_data, garch11};
use breccia_tests::{Instance, eight_schools};
use models::{Specimens, calibration_on};
use ppl::diagnostics::{ess_bulk, rhat};
use ppl::prelude::*;
use ppl::{Bound, Chains, Model, Workspace};

ppl::model! {
    /// Model low_dim_gauss_mix of posteriordb.
    fn mixture(y: &[f64]) {
        let mu ~ Normal(0.0, 2.0).array::<2>().ordered();
        let sigma ~ HalfNormal(2.0).array::<2>();
        let share ~ Beta(5.0, 5.0);
        for y in y {
            y ~ Mixture([share, 1.0 - share], [Normal(mu[0], sigma[0]), Normal(mu[1], sigma[1])]);
        }
    }
}

fn main() {
    // `cargo test --benches` only checks that the bench runs
    let quick = !std::env::args().any(|a| a == "--bench");
    println!("model,dim,quantity,value,unit");
    let instance = Instance::load();
    let prior = Instance::prior();
    report("paper_calibration", &calibration(&instance.pce, &instance.qois, &prior), quick);
    let rows: Vec<Vec<f64>> = instance.qois.iter().map(|row| row.to_vec()).collect();
    let specimens = Specimens::new(&rows).expect("rows of one length");
    report("calibration_on", &calibration_on(&*instance.pce, &prior, &specimens), quick);
    paper_setting(&calibration(&instance.pce, &instance.qois, &prior), quick);
    let (y, se) = (eight_schools::EFFECT, eight_schools::ERROR);
    report("eight_schools_non_centred", &eight_schools::non_centred(&y, &se), quick);
    let kids = Kidiq::load();
    let rows = kids.interaction((0.0, 1.0), (0.0, 1.0));
    report("kidscore_interaction", &kidscore(&rows, &kids.score), quick);
    report("radon_hierarchical", &radon_hierarchical(&houses()), quick);
    report("garch11", &garch11(&garch_data(), 0.5), quick);
    let (x, _, counts) = gp_data();
    report("poisson_gp", &gp_pois_regr(&x, &counts), quick);
    // quantiles of both components at equally spaced probabilities, instead of a random sample
    let scores = (0..500).map(|i| Normal(0.0, 1.0).quantile((f64::from(i) + 0.5) / 500.0));
    let values: Vec<f64> = scores.flat_map(|z| [-2.75 + z, 2.75 + z]).collect();
    report("gaussian_mixture", &mixture(&values), quick);
    let (hare, lynx) = lynx_hare_data();
    let solution = PredatorPrey::years();
    let model = lotka_volterra(&solution, &hare, &lynx);
    // a chain with a random start may stay in a minor mode, in which noise explains all data
    let mode = Map::default().find(&model).expect("the posterior has a mode").point;
    report_with("lotka_volterra", &model, Nuts::default().init_points(vec![mode; 4]), quick);
}

/// Whether the command line selects the model with this name. Without names, it selects all models.
fn asked(name: &str) -> bool {
    let mut parts = std::env::args().skip(1).filter(|part| !part.starts_with("--")).peekable();
    parts.peek().is_none() || parts.any(|part| name.contains(&part))
}

fn report<M: Model>(name: &str, model: &Bound<M>, quick: bool) {
    report_with(name, model, Nuts::default(), quick);
}

fn report_with<M: Model>(name: &str, model: &Bound<M>, sampler: Nuts<'_>, quick: bool) {
    if !asked(name) {
        return;
    }
    let dim = model.dim();
    let line = |quantity: &str, value: f64, unit: &str| {
        println!("{name},{dim},{quantity},{value:.4},{unit}");
    };
    let points: Vec<Vec<f64>> = (0..16)
        .map(|k| (0..dim).map(|i| 0.3 * f64::from((7 * i as i32 + 5 * k) % 11 - 5) / 5.0).collect())
        .collect();
    let batches = if quick { 1 } else { 201 };
    let mut workspace = Workspace::default();
    let value = least_ns(batches, |k| {
        black_box(model.log_density(&points[k % 16], &mut workspace)).is_ok()
    });
    line("value", value, "ns");
    let mut gradient = vec![0.0; dim];
    let full = least_ns(batches, |k| {
        black_box(model.gradient(&points[k % 16], &mut gradient, &mut workspace)).is_ok()
    });
    line("gradient", full, "ns");

    let sampler = sampler.chains(4).threads(1);
    let sampler = if quick { sampler.warmup(40).draws(20) } else { sampler.draws(2000) };
    let (seeds, repeats) = if quick { (1, 1) } else { (9, 3) };
    let (mut each, mut rates) = (f64::INFINITY, Vec::new());
    for seed in 1..=seeds {
        let (chains, seconds) = fastest(&sampler.clone().seed(seed), model, repeats);
        let stats = chains.chains.iter().flat_map(|c| c.stats.iter().chain(&c.warmup.stats));
        let leapfrogs: u64 = stats.map(|s| u64::from(s.leapfrogs)).sum();
        each = each.min(seconds * 1e9 / leapfrogs as f64);
        let effective = (0..dim).map(|i| {
            let traces = chains.traces(i);
            ess_bulk(&traces.iter().map(Vec::as_slice).collect::<Vec<_>>())
        });
        rates.push(effective.fold(f64::INFINITY, f64::min) / seconds);
    }
    line("leapfrog", each / 1000.0, "us");
    line("overhead_per_leapfrog", (each - full) / 1000.0, "us");
    rates.sort_by(f64::total_cmp);
    line("min_ess_bulk_per_second", rates[rates.len() / 2], "1/s");
}

/// Total time after which a run is not repeated.
const LONG_ENOUGH: Duration = Duration::from_secs(3);

/// Shortest time of several runs, which other programs on the machine disturb least. All runs give the same chains.
fn fastest<M: Model>(sampler: &Nuts<'_>, model: &Bound<M>, runs: usize) -> (Chains, f64) {
    let run = || {
        let start = Instant::now();
        let chains = sampler.run(model).expect("the model samples");
        (chains, start.elapsed().as_secs_f64())
    };
    let begin = Instant::now();
    let mut best = run();
    for _ in 1..runs {
        if begin.elapsed() > LONG_ENOUGH {
            break;
        }
        let next = run();
        if next.1 < best.1 {
            best = next;
        }
    }
    best
}

/// Times the paper's run, and the shortest run with a minimum ESS above 2000 and an R-hat below 1.01.
fn paper_setting<M: Model>(model: &Bound<M>, quick: bool) {
    if quick || !asked("paper_setting") {
        return;
    }
    for (threads, warmup, draws) in [(2, 2000, 50_000), (1, 250, 1500)] {
        let sampler =
            Nuts::default().chains(4).threads(threads).warmup(warmup).draws(draws).seed(1);
        let (chains, seconds) = fastest(&sampler, model, if draws > 10_000 { 3 } else { 21 });
        let traces: Vec<_> = (0..model.dim()).map(|i| chains.traces(i)).collect();
        let traces = || traces.iter().map(|t| t.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let ess = traces().map(|t| ess_bulk(&t)).fold(f64::INFINITY, f64::min);
        let r_hat = traces().map(|t| rhat(&t)).fold(0.0, f64::max);
        let run = format!("paper_setting,{},4x({warmup}+{draws})", model.dim());
        println!("{run} on {threads},{seconds:.4},s");
        println!("{run} min_ess_bulk,{ess:.0},1");
        println!("{run} r_hat,{r_hat:.5},1");
    }
}

/// Mean time of one call in ns, in the fastest of several short batches.
fn least_ns(batches: usize, mut call: impl FnMut(usize) -> bool) -> f64 {
    let mut time = |repeats: usize| {
        let start = Instant::now();
        for k in 0..repeats {
            assert!(call(k));
        }
        start.elapsed().as_secs_f64() * 1e9 / repeats as f64
    };
    let repeats = if batches == 1 { 2 } else { (3e5 / time(20)).ceil() as usize };
    (0..batches).map(|_| time(repeats)).fold(f64::INFINITY, f64::min)
}
