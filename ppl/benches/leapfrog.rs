//! Overhead of NUTS in addition to gradients, as CSV: `cargo bench -p ppl --bench leapfrog`.
//!
//! Reports nanoseconds per leapfrog step on an autoregression whose gradient is almost free, and the part that is not
//! the gradient: tree, mass matrix, random numbers. Uses one thread and the smallest of repeated timings.

use std::{hint::black_box, time::Instant};

use ppl::{LogDensity, Nuts, Rejection};

/// Standard normals whose neighbours have the entry −`coupling` in the precision matrix.
struct Chain {
    dim: usize,
    coupling: f64,
}

impl LogDensity for Chain {
    type Workspace = Vec<f64>;

    fn dim(&self) -> usize {
        self.dim
    }

    fn log_density(&self, y: &[f64], scratch: &mut Vec<f64>) -> Result<f64, Rejection> {
        scratch.resize(self.dim, 0.0);
        self.gradient(y, scratch, &mut Vec::new())
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], _: &mut Vec<f64>) -> Result<f64, Rejection> {
        let n = self.dim;
        g[0] = self.coupling * y[1] - y[0];
        for i in 1..n - 1 {
            g[i] = self.coupling * (y[i - 1] + y[i + 1]) - y[i];
        }
        g[n - 1] = self.coupling * y[n - 2] - y[n - 1];
        Ok(0.5 * y.iter().zip(g).map(|(y, g)| y * *g).sum::<f64>())
    }
}

fn main() {
    // `cargo test --benches` only checks that the benchmark runs
    let quick = !std::env::args().any(|a| a == "--bench");
    let (repeats, draws, calls) = if quick { (1, 100, 100) } else { (200, 2000, 20_000) };
    println!("map,dim,leapfrog_ns,gradient_ns,overhead_ns");
    for (dim, coupling, nuts) in [
        (10, 0.0, Nuts::stan_compatible()),
        (10, 0.45, Nuts::default()),
        (100, 0.45, Nuts::stan_compatible()),
        (100, 0.45, Nuts::default()),
    ] {
        let density = Chain { dim, coupling };
        let (y, mut g) = (vec![0.3; dim], vec![0.0; dim]);
        // resume from a tuned state, so that no warmup is timed
        let nuts = nuts.chains(1).threads(1).seed(1);
        let tuned = nuts.clone().warmup(500).draws(1).run(&density).expect("samples");
        let map =
            tuned.chains[0].warmup.switches.last().map_or("none".into(), |s| s.map.to_string());
        let (run, before) = (nuts.draws(draws), tuned.evaluations());
        // gradient and leapfrog batches alternate, so that a change of the processor's speed affects both
        let (mut leapfrog, mut gradient) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..repeats {
            let start = Instant::now();
            for _ in 0..calls {
                let value = density.gradient(black_box(&y), &mut g, &mut Vec::new());
                black_box((value.ok(), &g));
            }
            gradient = gradient.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(calls));
            let tuned = tuned.clone();
            let start = Instant::now();
            let chains = run.resume(&density, tuned).expect("samples");
            let leapfrogs = (chains.evaluations() - before) as f64;
            leapfrog = leapfrog.min(start.elapsed().as_secs_f64() * 1e9 / leapfrogs);
        }
        println!("{map},{dim},{leapfrog:.1},{gradient:.1},{:.1}", leapfrog - gradient);
    }
}
