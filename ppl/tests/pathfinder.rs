//! Pathfinder against densities whose answer is known.

use ppl::{
    LogDensity, Nuts, OptimizeError, Pathfinder, Posterior, Rejection, SampleError, prelude::*,
};

/// A density given by a function that returns its value and gradient.
struct Function<F> {
    dim: usize,
    function: F,
}

impl<F> LogDensity for Function<F>
where
    F: Fn(&[f64], &mut [f64]) -> Result<f64, Rejection> + Sync,
{
    type Workspace = Vec<f64>;

    fn dim(&self) -> usize {
        self.dim
    }

    fn log_density(&self, y: &[f64], scratch: &mut Vec<f64>) -> Result<f64, Rejection> {
        scratch.resize(self.dim, 0.0);
        (self.function)(y, scratch)
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], _: &mut Vec<f64>) -> Result<f64, Rejection> {
        (self.function)(y, g)
    }
}

const MEAN: [f64; 2] = [1.0, -2.0];
const COVARIANCE: [[f64; 2]; 2] = [[1.0, 1.6], [1.6, 4.0]];

/// Normal with correlation 0.8, normalised.
fn gaussian() -> impl LogDensity {
    let determinant = COVARIANCE[0][0] * COVARIANCE[1][1] - COVARIANCE[0][1] * COVARIANCE[1][0];
    let function = move |y: &[f64], g: &mut [f64]| {
        let (a, b) = (y[0] - MEAN[0], y[1] - MEAN[1]);
        g[0] = -(COVARIANCE[1][1] * a - COVARIANCE[0][1] * b) / determinant;
        g[1] = -(COVARIANCE[0][0] * b - COVARIANCE[0][1] * a) / determinant;
        Ok(0.5 * (a * g[0] + b * g[1] - determinant.ln()) - std::f64::consts::TAU.ln())
    };
    Function { dim: 2, function }
}

/// Rosenbrock's valley as a density: y₁ given y₀ is Normal(y₀², 0.3).
fn banana() -> impl LogDensity {
    let function = |y: &[f64], g: &mut [f64]| {
        let bend = (y[1] - y[0] * y[0]) / 0.09;
        g[0] = -y[0] + 2.0 * y[0] * bend;
        g[1] = -bend;
        Ok(-0.5 * y[0] * y[0] - 0.5 * (y[1] - y[0] * y[0]) * bend)
    };
    Function { dim: 2, function }
}

ppl::model! {
    fn eight_schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for j in 0..8 {
            effects[j] ~ Normal(mu + tau * z[j], errors[j]);
        }
    }
}

const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

/// A normal is its own approximation: mean and covariance as the optimiser converges, log evidence
/// 0, and moments of the draws within their errors.
#[test]
fn a_normal_is_found() {
    for paths in [1, 4] {
        let fit = Pathfinder::default().paths(paths).seed(3).run(&gaussian()).expect("runs");
        assert_eq!(fit.paths.len(), paths);
        assert!(fit.is_reliable(), "k = {}", fit.pareto_k);
        let best = fit.paths.iter().max_by(|a, b| a.elbo.total_cmp(&b.elbo)).expect("a path");
        assert!(best.elbo.abs() < 0.05, "{}", best.elbo);
        let covariance = best.covariance();
        for i in 0..2 {
            assert!((best.mean()[i] - MEAN[i]).abs() < 0.1);
            for j in 0..2 {
                assert!((covariance[(i, j)] - COVARIANCE[i][j]).abs() < 0.15, "{covariance}");
            }
        }
        // 1000 resampled of at least as many: independent but for repetitions, so twice the error
        for i in 0..2 {
            let draws = || fit.draws.iter().skip(i).step_by(2);
            let mean = draws().sum::<f64>() / 1000.0;
            let error = (2.0 * COVARIANCE[i][i] / 1000.0_f64).sqrt();
            assert!((mean - MEAN[i]).abs() < 4.0 * error, "{mean}");
            let variance = draws().map(|y| (y - MEAN[i]).powi(2)).sum::<f64>() / 1000.0;
            let error = COVARIANCE[i][i] * (4.0 / 1000.0_f64).sqrt();
            assert!((variance - COVARIANCE[i][i]).abs() < 4.0 * error, "{variance}");
        }
    }
}

/// No normal covers a bent valley, and k says so; for a normal it does not, whatever the seed.
#[test]
fn k_tells_a_banana_from_a_normal() {
    for seed in 1..6 {
        let fit = Pathfinder::default().seed(seed).run(&banana()).expect("runs");
        let normal = Pathfinder::default().seed(seed).run(&gaussian()).expect("runs");
        assert!(normal.is_reliable(), "normal: k = {}", normal.pareto_k);
        assert!(fit.pareto_k > normal.pareto_k + 0.2, "banana: k = {}", fit.pareto_k);
        // every path stays in the valley round the mode at the origin
        for path in &fit.paths {
            assert!(path.elbo.is_finite() && path.iterate < path.iterates);
            assert!(path.mean().iter().all(|m| m.abs() < 3.0), "{:?}", path.mean());
        }
    }
}

/// The tail of tau is too long for a normal: k says so, and the draws are no worse than the
/// posterior's own spread (by NUTS: mu 4.4 ± 3.3).
#[test]
fn eight_schools_become_a_posterior() {
    let model = eight_schools(&EFFECTS, &ERRORS);
    let fit = Pathfinder::default().seed(2).run(&model).expect("runs");
    assert!(!fit.is_reliable(), "k = {}", fit.pareto_k);
    let posterior = Posterior::from_chains(&model, fit.chains(), 2).expect("a posterior");
    let median = posterior.summary().row("mu").expect("an unknown").q50;
    assert!((median - 4.4).abs() < 3.3, "{median}");
}

#[test]
fn the_same_seed_gives_the_same_draws_on_any_number_of_threads() {
    let model = eight_schools(&EFFECTS, &ERRORS);
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Pathfinder::default().seed(seed).run(&model)).expect("runs").draws
    };
    let one = run(1, 5);
    assert_eq!(run(3, 5), one);
    assert_ne!(run(1, 6), one);
}

/// Chains start in the posterior: at no lower log density than draws have.
#[test]
fn nuts_starts_from_paths() {
    let far = Function {
        dim: 3,
        function: |y: &[f64], g: &mut [f64]| {
            for (g, y) in g.iter_mut().zip(y) {
                *g = -(y - 500.0);
            }
            Ok(-0.5 * y.iter().map(|y| (y - 500.0).powi(2)).sum::<f64>())
        },
    };
    let nuts = Nuts::default().chains(6).warmup(100).draws(50).seed(4).init_pathfinder();
    let chains = nuts.run(&far).expect("runs");
    for (k, chain) in chains.chains.iter().enumerate() {
        assert!(chain.warmup.start.iter().all(|y| (y - 500.0).abs() < 6.0));
        assert!(chains.chains[..k].iter().all(|other| other.warmup.start != chain.warmup.start));
    }
    assert_eq!(nuts.run(&far).expect("runs"), chains);
}

/// Two unit normals 12 apart, the left one e^`gap` times as heavy.
fn two_modes(gap: f64) -> impl LogDensity {
    let function = move |y: &[f64], g: &mut [f64]| {
        let side = if y[0] < 0.5 { -1.0 } else { 1.0 };
        let (a, b) = (y[0] - 6.0 * side, y[1]);
        (g[0], g[1]) = (-a, -b);
        Ok(-0.5 * (a * a + b * b) + if side < 0.0 { gap } else { 0.0 })
    };
    Function { dim: 2, function }
}

/// A path that ends in a mode of no weight starts no chain; modes that count keep theirs.
#[test]
fn nuts_starts_in_modes_that_have_weight() {
    let on_the_left = |gap: f64| {
        let nuts = Nuts::default().chains(8).warmup(60).draws(20).seed(4).init_pathfinder();
        let chains = nuts.run(&two_modes(gap)).expect("runs").chains;
        chains.iter().filter(|chain| chain.warmup.start[0] < 0.5).count()
    };
    let both = on_the_left(0.0);
    assert!((1..8).contains(&both), "{both}");
    assert_eq!(on_the_left(3.0), both);
    assert_eq!(on_the_left(40.0), 8);
}

#[test]
fn what_cannot_be_approximated_is_refused() {
    let rising = Function {
        dim: 1,
        function: |y: &[f64], g: &mut [f64]| {
            if y[0] > 3.0 {
                return Err(Rejection::Fatal { message: "out of paper".into() });
            }
            g[0] = 1.0;
            Ok(y[0])
        },
    };
    let error = Pathfinder::default().run(&rising).expect_err("fatal");
    assert!(error.to_string().contains("out of paper"), "{error}");
    let nuts = Nuts::default().init_pathfinder().run(&rising).expect_err("fatal");
    assert!(matches!(nuts, SampleError::Pathfinder(_)), "{nuts}");
    let empty = Function { dim: 0, function: |_: &[f64], _: &mut [f64]| Ok(0.0) };
    assert!(matches!(Pathfinder::default().run(&empty), Err(OptimizeError::NoUnknowns)));
    for (pathfinder, name) in [
        (Pathfinder::default().paths(0), "paths"),
        (Pathfinder::default().draws(0), "draws"),
        (Pathfinder::default().elbo_draws(0), "elbo_draws"),
        (Pathfinder::default().iterations(0), "iterations"),
    ] {
        let error = pathfinder.run(&gaussian()).expect_err(name);
        assert!(matches!(error, OptimizeError::Setting { setting, .. } if setting == name));
    }
}
