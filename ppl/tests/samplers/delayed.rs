//! Delayed acceptance: the draws have the expensive density, whatever the screening density is.

use std::sync::atomic::{AtomicU64, Ordering};

use ppl::prelude::*;
use ppl::{Chains, Rejection, RunError};

use crate::targets::{Function, Gaussian, assert_gaussian_moments, assert_mean, half_normal};

/// A normal density with another mean, wider, and with the opposite correlation.
fn biased() -> Gaussian {
    let mut cheap = Gaussian::autoregressive(2, -0.3, 2.0, 2.5);
    cheap.mean.add_scalar_mut(1.5);
    cheap
}

#[test]
fn a_biased_screen_leaves_the_posterior_alone() {
    let target = Gaussian::autoregressive(2, 0.7, 1.0, 2.0);
    let flat = Function { dim: 2, function: |_: &[f64], _: &mut [f64]| Ok(7.0) };
    for steps in [1, 5] {
        let sampler = DelayedAcceptance::default().screening_steps(steps).draws(5000).thin(10);
        let chains = sampler.clone().seed(1).run(&biased(), &target).expect("runs");
        assert_gaussian_moments(&target, &chains);
        // the screening density has another mean, so that the comparison above can fail
        let alone = Metropolis::default().seed(1).run(&biased()).expect("runs");
        let mean = |chains: &Chains| chains.traces(0).concat().iter().sum::<f64>();
        assert!((mean(&alone) / 40_000.0 - mean(&chains) / 20_000.0).abs() > 1.0);
        if steps == 1 {
            let chains = sampler.seed(2).run(&flat, &target).expect("runs");
            assert_gaussian_moments(&target, &chains);
        }
    }
}

/// Points that only the expensive density rejects are counted and never stored.
#[test]
fn a_screen_that_ignores_a_wall() {
    let screen = Gaussian::autoregressive(1, 0.0, 1.2, 1.2);
    let sampler = DelayedAcceptance::default().screening_steps(2).draws(5000).thin(5).seed(5);
    let chains = sampler.run(&screen, &half_normal()).expect("runs");
    assert_mean("mean", &chains, (2.0 / std::f64::consts::PI).sqrt(), |y| y[0]);
    assert_mean("square", &chains, 1.0, |y| y[0] * y[0]);
    assert!(chains.chains.iter().all(|chain| !chain.rejections.is_empty()));
}

/// With a perfect screen every decision accepts, and rejections by the screen cost no expensive evaluation.
#[test]
fn expensive_evaluations_are_counted() {
    let calls = AtomicU64::new(0);
    let expensive = Function {
        dim: 3,
        function: |y: &[f64], _: &mut [f64]| {
            calls.fetch_add(1, Ordering::Relaxed);
            Ok(-0.5 * y.iter().map(|y| y * y).sum::<f64>())
        },
    };
    let cheap = Function {
        dim: 3,
        function: |y: &[f64], _: &mut [f64]| Ok(3.0 - 0.5 * y.iter().map(|y| y * y).sum::<f64>()),
    };
    let sampler = DelayedAcceptance::default().warmup(1000).draws(1000).thin(2).seed(2);
    let chains = sampler.run(&cheap, &expensive).expect("runs");
    // plus the evaluation at each chain's starting point
    assert_eq!(chains.evaluations() + 4, calls.load(Ordering::Relaxed));
    let share = chains.evaluations() as f64 / (4.0 * 3000.0);
    assert!((share - 0.3).abs() < 0.05, "{share}: the acceptance of the screen, 0.234 + 0.206/3");
    for chain in &chains.chains {
        let decided = chain.warmup.stats.iter().filter(|s| s.leapfrogs == 1);
        assert!(decided.into_iter().all(|s| s.acceptance > 1.0 - 1e-12));
    }
}

/// Warmup transitions on the screening density alone evaluate no expensive density, and 60 further warmup transitions
/// remove their bias.
#[test]
fn a_warmup_on_the_screen_alone_costs_nothing_and_leaves_no_trace() {
    let calls = AtomicU64::new(0);
    let target = Gaussian::autoregressive(2, 0.7, 1.0, 2.0);
    let counted = Counted { target: &target, calls: &calls };
    let (chains, draws, thin, decided) = (4, 4000, 5, 60);
    let sampler = DelayedAcceptance::default().chains(chains).draws(draws).thin(thin).seed(8);
    let sampler = sampler.screening_steps(3).warmup(600 + decided).screened_warmup(600);
    let found = sampler.run(&biased(), &counted).expect("runs");
    assert_eq!(found.evaluations(), calls.load(Ordering::Relaxed));
    for chain in &found.chains {
        assert!(chain.warmup.stats[..600].iter().all(|s| s.leapfrogs == 0));
        assert!(chain.warmup.stats[600].leapfrogs >= 1, "its own start is asked for");
    }
    assert_gaussian_moments(&target, &found);
    // the whole warmup on the screening density, with a setting longer than the warmup
    let all = sampler.screened_warmup(9999).run(&biased(), &target).expect("runs");
    assert!(all.chains.iter().all(|c| c.warmup.stats.iter().all(|s| s.leapfrogs == 0)));
    assert_gaussian_moments(&target, &all);
}

/// If the screened warmup ends outside the support, the first proposal inside it is accepted.
#[test]
fn a_warmup_on_the_screen_may_end_where_the_density_is_zero() {
    let mut screen = Gaussian::autoregressive(1, 0.0, 1.2, 1.2);
    screen.mean.add_scalar_mut(-1.0);
    let sampler = DelayedAcceptance::default().screening_steps(4).draws(5000).thin(5).seed(5);
    let sampler = sampler.warmup(540).screened_warmup(500);
    let chains = sampler.run(&screen, &half_normal()).expect("runs");
    assert!(chains.chains.iter().any(|c| c.warmup.stats[499].log_density.is_finite()));
    assert_mean("mean", &chains, (2.0 / std::f64::consts::PI).sqrt(), |y| y[0]);
}

/// A density that counts its evaluations.
struct Counted<'a> {
    target: &'a Gaussian,
    calls: &'a AtomicU64,
}

impl LogDensity for Counted<'_> {
    type Workspace = <Gaussian as LogDensity>::Workspace;

    fn dim(&self) -> usize {
        self.target.dim()
    }

    fn log_density(&self, y: &[f64], w: &mut Self::Workspace) -> Result<f64, Rejection> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.target.log_density(y, w)
    }

    fn gradient(
        &self,
        y: &[f64],
        g: &mut [f64],
        w: &mut Self::Workspace,
    ) -> Result<f64, Rejection> {
        self.target.gradient(y, g, w)
    }
}

/// More screening steps for each decision give less correlated draws per expensive evaluation.
#[test]
fn a_good_screen_saves_expensive_evaluations() {
    let target = Gaussian::autoregressive(3, 0.8, 1.0, 3.0);
    let mut cheap = Gaussian::autoregressive(3, 0.75, 1.1, 3.2);
    cheap.mean.add_scalar_mut(0.1);
    let cost = |steps| {
        let sampler = DelayedAcceptance::default().screening_steps(steps).seed(1);
        let chains = sampler.run(&cheap, &target).expect("runs");
        let traces = chains.traces(1);
        let slices: Vec<&[f64]> = traces.iter().map(Vec::as_slice).collect();
        chains.evaluations() as f64 / ppl::diagnostics::ess_bulk(&slices)
    };
    let (one, many) = (cost(1), cost(20));
    assert!(many < 0.6 * one, "{many} and {one} expensive evaluations per effective draw");
}

/// If the screening density has lighter tails than the target, chains stick far out; a screening density that is
/// widened by an exponent releases the chains.
#[test]
fn a_narrow_screen_is_widened_by_a_power() {
    let target = Gaussian::autoregressive(4, 0.5, 1.0, 2.0);
    let narrow = Gaussian::autoregressive(4, 0.5, 0.7, 1.4);
    let sampler = DelayedAcceptance::default().screening_steps(20).draws(5000).seed(1);
    let run = |power| sampler.clone().screening_power(power).run(&narrow, &target).expect("runs");
    let (stuck, wide) = (run(1.0), run(0.4));
    assert_gaussian_moments(&target, &wide);
    let ess = |chains: &Chains| {
        let traces = chains.traces(0);
        let slices: Vec<&[f64]> = traces.iter().map(Vec::as_slice).collect();
        ppl::diagnostics::ess_bulk(&slices)
    };
    assert!(ess(&wide) > 3.0 * ess(&stuck), "{} and {}", ess(&wide), ess(&stuck));
}

/// With a screen of half the target's width, chains stick at far points, where the ratio p/q of target to screen is
/// largest. With a share of unscreened steps the chains of all 8 seeds mix and have the right moments.
#[test]
fn steps_without_screening_release_chains_of_a_narrow_screen() {
    let target = Gaussian::autoregressive(4, 0.5, 1.0, 2.0);
    let narrow = Gaussian::autoregressive(4, 0.5, 0.5, 1.0);
    let sampler = DelayedAcceptance::default().screening_steps(20).draws(10_000);
    let rhat = |chains: &Chains| {
        let of = |i: usize| {
            let traces = chains.traces(i);
            let slices: Vec<&[f64]> = traces.iter().map(Vec::as_slice).collect();
            ppl::diagnostics::rhat(&slices)
        };
        (0..4).map(of).fold(0.0, f64::max)
    };
    let mut stuck = 0;
    for seed in 1..=8 {
        let sampler = sampler.clone().seed(seed);
        let plain = sampler.clone().plain_share(0.4).run(&narrow, &target).expect("runs");
        assert_gaussian_moments(&target, &plain);
        let found = rhat(&plain);
        let without = rhat(&sampler.run(&narrow, &target).expect("runs"));
        assert!(found < 1.02, "seed {seed}: {found}");
        stuck += usize::from(without > 1.02);
    }
    assert!(stuck >= 4, "without such steps {stuck} seeds of 8 stick");
}

/// Unscreened steps reach points where the screening density is zero, and the draws have the target density.
#[test]
fn steps_without_screening_reach_what_the_screen_excludes() {
    let target = Gaussian::autoregressive(1, 0.0, 1.0, 1.0);
    let walled = half_normal();
    let sampler = DelayedAcceptance::default().screening_steps(3).plain_share(0.5).draws(8000);
    let chains = sampler.thin(5).seed(3).run(&walled, &target).expect("runs");
    assert_gaussian_moments(&target, &chains);
    let outside = chains.traces(0).concat().iter().filter(|y| **y <= 0.0).count();
    assert!(outside > 1000, "{outside} of 32 000 draws where the screen is zero");
}

ppl::model! {
    fn expensive(y: &[f64]) {
        let mu ~ Normal(0.0, 2.0);
        let sd ~ HalfNormal(2.0);
        for y in y {
            y ~ Normal(mu, sd);
        }
    }
}

ppl::model! {
    /// A model with the same unknowns as the expensive model and another likelihood.
    fn cheap(centre: f64, error: f64) {
        let mu ~ Normal(0.0, 2.0);
        let sd ~ HalfNormal(2.0);
        centre ~ Normal(mu, error);
    }
}

ppl::model! {
    fn other() {
        let mu ~ Normal(0.0, 2.0).array::<2>();
    }
}

#[test]
fn models_are_screened_by_models_of_the_same_unknowns() {
    let data = [0.4, 1.9, -0.3, 1.1, 0.8];
    let model = expensive(&data);
    let sampler = DelayedAcceptance::default().screening_steps(3).draws(3000).thin(5).seed(3);
    let screened = sampler.sample(&cheap(1.5, 1.5), &model).expect("samples");
    let reference = Nuts::default().draws(4000).seed(3).sample(&model).expect("samples");
    for name in ["mu", "sd"] {
        let row = reference.summary().row(name).expect("named").clone();
        let estimate = ppl::check::mean(&screened, name, row.mean);
        estimate.reference_error(row.mcse_mean).within_mcse(4.0);
    }
    assert!(screened.log_likelihood.get("y").is_some(), "everything of the expensive model");

    let error = sampler.sample(&other(), &model).expect_err("other unknowns").to_string();
    assert!(error.contains("has mu[2] and the deciding model has mu, sd"), "{error}");
    let error = sampler.run(&biased(), &half_normal()).expect_err("other dimensions");
    assert!(matches!(error, RunError::Screening { .. }), "{error}");
    let error = sampler.clone().screening_steps(0).run(&biased(), &biased()).expect_err("no steps");
    assert!(matches!(error, RunError::Setting { setting: "screening_steps", .. }));
    for share in [-0.1, 1.0, f64::NAN] {
        let sampler = sampler.clone().plain_share(share);
        let error = sampler.run(&biased(), &biased()).expect_err("no share");
        assert!(matches!(error, RunError::Setting { setting: "plain_share", .. }));
    }
    for power in [0.0, 1.1, f64::NAN] {
        let sampler = sampler.clone().screening_power(power);
        let error = sampler.run(&biased(), &biased()).expect_err("no power");
        assert!(matches!(error, RunError::Setting { setting: "screening_power", .. }));
    }
}

#[test]
fn draws_do_not_depend_on_the_number_of_threads() {
    let target = Gaussian::autoregressive(2, 0.7, 1.0, 2.0);
    let sampler = DelayedAcceptance::default().chains(5).warmup(100).draws(50).screening_steps(2);
    let sampler = sampler.plain_share(0.3);
    let one = sampler.clone().threads(1).run(&biased(), &target).expect("runs");
    assert_eq!(sampler.threads(3).run(&biased(), &target).expect("runs"), one);
}
