//! Threads, interrupts, failures and settings of runs.

use std::sync::{
    Mutex,
    atomic::{AtomicBool, Ordering},
};

use ppl::{
    Bound, ChainStatus, Context, Metropolis, Model, Nuts, Progress, Rejection, RunError,
    SampleError, Scalar, Site, StopReason, Uniform, diagnostics::mcse_mean,
};

use crate::targets::{Function, Gaussian, WALL, half_normal, normal_until};

#[test]
fn draws_do_not_depend_on_the_number_of_threads() {
    let target = Gaussian::autoregressive(4, 0.6, 0.5, 2.0);
    let nuts = Nuts::default().chains(5).warmup(200).draws(100).seed(8);
    let metropolis = Metropolis::default().chains(5).warmup(200).draws(100).seed(8);
    let one = nuts.clone().threads(1).run(&target).expect("runs");
    let walk = metropolis.clone().threads(1).run(&target).expect("runs");
    for threads in [2, 3, 5] {
        assert_eq!(nuts.clone().threads(threads).run(&target).expect("runs"), one);
        assert_eq!(metropolis.clone().threads(threads).run(&target).expect("runs"), walk);
    }
    assert_eq!(nuts.run(&target).expect("runs"), one);
    assert_ne!(one.chains[0].draws, one.chains[1].draws);
}

#[test]
fn another_seed_gives_other_draws_and_more_chains_keep_the_first() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let nuts = Nuts::default().chains(2).warmup(50).draws(20);
    let two = nuts.clone().seed(1).run(&target).expect("runs");
    assert_ne!(nuts.clone().seed(2).run(&target).expect("runs"), two);
    let three = nuts.seed(1).chains(3).run(&target).expect("runs");
    assert_eq!(three.chains[..2], two.chains);
}

/// The draws of a seed are part of the interface; a change of these numbers must be intended and goes into the
/// changelog.
#[test]
fn the_stream_of_a_seed_is_fixed() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let last = |chains: ppl::Chains| chains.chains[1].draws[18..].to_vec();
    let nuts = Nuts::default().warmup(20).draws(10).seed(7).run(&target).expect("runs");
    let stan = Nuts::stan_compatible().warmup(20).draws(10).seed(7).run(&target).expect("runs");
    let walk = Metropolis::default().warmup(20).draws(10).seed(7).run(&target).expect("runs");
    let golden = [
        [-0.5989834979409694, -0.7160783261731437],
        [-2.154970112070809, 0.5502191390768443],
        [-1.9061906097588985, -1.6364976365250428],
    ];
    for (chains, golden) in [nuts, stan, walk].into_iter().zip(golden) {
        for (value, golden) in last(chains).into_iter().zip(golden) {
            approx::assert_relative_eq!(value, golden, max_relative = 1e-8);
        }
    }
}

#[test]
fn thinning_keeps_every_third_transition() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let nuts = Nuts::default().chains(1).warmup(50).seed(1);
    let all = nuts.clone().draws(30).run(&target).expect("runs").chains.remove(0);
    let thinned = nuts.draws(10).thin(3).run(&target).expect("runs").chains.remove(0);
    for draw in 0..10 {
        assert_eq!(thinned.draws[2 * draw..][..2], all.draws[2 * (3 * draw + 2)..][..2]);
        let since = &all.stats[3 * draw..][..3];
        let (stats, last) = (thinned.stats[draw], since[2]);
        assert_eq!(stats.leapfrogs, since.iter().map(|s| s.leapfrogs).sum::<u32>());
        let acceptance = since.iter().map(|s| s.acceptance).sum::<f64>() / 3.0;
        approx::assert_relative_eq!(stats.acceptance, acceptance, max_relative = 1e-14);
        assert_eq!((stats.log_density, stats.energy), (last.log_density, last.energy));
    }
}

/// With thinning, a stored draw is divergent if any transition since the previous stored draw was.
#[test]
fn thinning_keeps_divergences() {
    let nuts = Nuts::default().chains(1).warmup(50).init_points(vec![vec![1.0]]).seed(1);
    let all = nuts.clone().draws(300).run(&half_normal()).expect("runs").chains.remove(0);
    let thinned = nuts.draws(100).thin(3).run(&half_normal()).expect("runs").chains.remove(0);
    let any = |draw: usize| all.stats[3 * draw..][..3].iter().any(|s| s.divergent);
    let expected: Vec<usize> = (0..100).filter(|&draw| any(draw)).collect();
    let found: Vec<usize> = thinned.divergences.iter().map(|d| d.draw).collect();
    assert!(!expected.is_empty() && found == expected, "{found:?}, {expected:?}");
}

/// The draws of an interrupted run equal the first draws of the complete run.
#[test]
fn an_interrupt_keeps_the_draws_so_far() {
    let flag = AtomicBool::new(false);
    let raise = || {
        flag.store(true, Ordering::Relaxed);
        Ok(())
    };
    let nuts = Nuts::default().chains(1).warmup(100).draws(2000).seed(3);
    let cut = nuts.clone().interrupt(&flag).run(&normal_until(3, 5000, raise)).expect("runs");
    let whole = nuts.run(&normal_until(3, usize::MAX, || Ok(()))).expect("runs");
    let (cut, whole) = (&cut.chains[0], &whole.chains[0]);
    assert_eq!(cut.stopped, Some(StopReason::Interrupted));
    assert_eq!(whole.stopped, None);
    assert!(!cut.is_empty() && cut.len() < whole.len());
    assert_eq!(cut.draws, whole.draws[..cut.draws.len()]);
    assert_eq!(cut.stats, whole.stats[..cut.len()]);
}

#[test]
fn an_interrupt_in_the_warmup_leaves_no_draws() {
    let flag = AtomicBool::new(true);
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let chains = Nuts::default().interrupt(&flag).run(&target).expect("runs");
    assert_eq!(chains.len(), 0);
    assert!(chains.chains.iter().all(|c| c.stopped == Some(StopReason::Interrupted)));
}

#[test]
fn a_fatal_error_ends_the_run_and_keeps_its_draws() {
    #[derive(Debug, thiserror::Error)]
    #[error("the licence server is gone")]
    struct Gone;
    let fail = || Err(Rejection::fatal(Gone));
    let target = normal_until(2, 6000, fail);
    let chains = Nuts::default().chains(1).warmup(100).draws(4000).run(&target).expect("runs");
    let chain = &chains.chains[0];
    let reason = chain.stopped.as_ref().expect("it ended early");
    assert!(matches!(reason, StopReason::Fatal(_)));
    assert_eq!(reason.to_string(), "the licence server is gone");
    let cause = std::error::Error::source(reason).expect("the error of the density");
    assert!(cause.is::<Gone>(), "{cause:?}");
    assert!(!chain.is_empty() && chain.len() < 4000);
    assert_eq!(chain.draws.len(), 2 * chain.len());
}

#[test]
fn a_density_that_rejects_everything_says_where() {
    let target = Function {
        dim: 2,
        function: |_: &[f64], _: &mut [f64]| {
            Err(Rejection::NotFinite { location: WALL, value: f64::NAN })
        },
    };
    let error = Nuts::default().run(&target).expect_err("cannot start");
    assert!(error.to_string().contains("100 × `y > 0` (targets.rs:1)"), "{error}");
    let RunError::Initialisation { chain: 0, tries: 100, rejections, .. } = error else {
        panic!("{error}")
    };
    assert_eq!(rejections[&WALL], 100);
    let metropolis = Metropolis::default().init_points(vec![vec![0.0; 2]; 4]).run(&target);
    assert!(matches!(metropolis, Err(RunError::Initialisation { tries: 1, .. })));
}

#[test]
fn a_start_without_a_finite_gradient_is_no_start() {
    let target = Function {
        dim: 1,
        function: |_: &[f64], g: &mut [f64]| {
            g[0] = f64::NAN;
            Ok(0.0)
        },
    };
    let error = Nuts::default().run(&target).expect_err("cannot start").to_string();
    assert!(error.contains("gradient of the log density"), "{error}");
}

/// A model without unknowns has a single point, and every draw is that point.
#[test]
fn no_unknowns() {
    let target = Function { dim: 0, function: |_: &[f64], _: &mut [f64]| Ok(-1.5) };
    let nuts = Nuts::default().draws(20).run(&target).expect("runs");
    let metropolis = Metropolis::default().draws(20).run(&target).expect("runs");
    for chains in [nuts, metropolis] {
        assert_eq!((chains.dim, chains.len()), (0, 20));
        for chain in &chains.chains {
            assert!(chain.draws.is_empty() && chain.warmup.stats.is_empty());
            assert!(chain.stats.iter().all(|s| s.log_density == -1.5 && s.acceptance == 1.0));
            assert!(chain.warmup.step_size.is_finite());
        }
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let cases = [
        (Nuts::default().chains(0), "chains"),
        (Nuts::default().draws(0), "draws"),
        (Nuts::default().draws(usize::MAX), "draws"),
        (Nuts::default().draws(10).thin(usize::MAX), "thin"),
        (Nuts::default().warmup(usize::MAX), "warmup"),
        (Nuts::default().thin(0), "thin"),
        (Nuts::default().threads(0), "threads"),
        (Nuts::default().target_accept(1.0), "target_accept"),
        (Nuts::default().target_accept(f64::NAN), "target_accept"),
        (Nuts::default().max_depth(0), "max_depth"),
        (Nuts::default().max_depth(21), "max_depth"),
        (Nuts::default().init_radius(f64::INFINITY), "init_radius"),
        (Nuts::default().init_points(vec![vec![0.0; 2]; 3]), "init_points"),
        (Nuts::default().init_points(vec![vec![0.0]; 4]), "init_points"),
    ];
    for (nuts, name) in cases {
        let error = nuts.run(&target).expect_err(name);
        assert!(matches!(error, RunError::Setting { setting, .. } if setting == name), "{error}");
    }
}

#[derive(Default)]
struct Log(Mutex<Vec<ChainStatus>>);

impl Progress for Log {
    fn update(&self, status: &ChainStatus) {
        self.0.lock().expect("no panic").push(*status);
    }
}

#[test]
fn every_chain_reports_its_end_once() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let log = Log::default();
    Nuts::default().chains(3).warmup(100).draws(50).progress(&log).run(&target).expect("runs");
    let log = log.0.into_inner().expect("no panic");
    for chain in 0..3 {
        let mine: Vec<_> = log.iter().filter(|s| s.chain == chain).collect();
        assert!(mine.windows(2).all(|w| w[0].done <= w[1].done));
        let ends: Vec<_> = mine.iter().filter(|s| s.finished).collect();
        assert_eq!(ends.len(), 1);
        assert_eq!((ends[0].done, ends[0].total, ends[0].tuning), (150, 150, false));
        assert!(ends[0].draws_per_second > 0.0 && ends[0].step_size > 0.0);
    }
}

/// p ~ Uniform(0, 1) and 7 successes in 10: the posterior is Beta(8, 4).
struct Coin;

impl Model for Coin {
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
        static P: Site = Site::new("p");
        static FLIPS: Site = Site::new("flips");
        let p = cx.unknown(&P, Uniform(0.0, 1.0))?;
        cx.factor(&FLIPS, p.ln() * 7.0 + (-p).ln_1p() * 3.0)
    }
}

#[test]
fn a_model_is_sampled_by_name() {
    let coin = Bound::new(Coin);
    let nuts = Nuts::default().seed(1).sample(&coin).expect("samples");
    let metropolis = Metropolis::default().thin(5).draws(2000).sample(&coin).expect("samples");
    for posterior in [nuts, metropolis] {
        let p = posterior.values("p").expect("by name");
        let chains: Vec<&[f64]> = p.data.chunks_exact(p.data.len() / 4).collect();
        let mean = p.data.iter().sum::<f64>() / p.data.len() as f64;
        assert!((mean - 8.0 / 12.0).abs() < 4.0 * mcse_mean(&chains), "{mean}");
    }
    let flag = AtomicBool::new(true);
    let stopped = Nuts::default().interrupt(&flag).sample(&coin);
    assert!(matches!(stopped, Err(SampleError::Posterior(_))));
}
