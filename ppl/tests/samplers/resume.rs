//! Runs that are resumed.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use ppl::{
    Chains, ChainsFileError, DelayedAcceptance, InverseMassMatrix, Location, LogDensity,
    Metropolis, Nuts, Rejection, RunError,
};

use crate::targets::{Gaussian, half_normal, normal_until, until};

/// A density whose evaluations a test can observe.
trait Target: LogDensity<Workspace: Default> {}

impl<D: LogDensity<Workspace: Default>> Target for D {}

/// The operations that all samplers of chains have.
trait Sampler: Clone {
    fn begin(&self, target: &impl Target) -> Result<Chains, RunError>;
    fn go_on(&self, target: &impl Target, earlier: Chains) -> Result<Chains, RunError>;
    fn until(self, flag: &'static AtomicBool) -> Self;
}

macro_rules! samplers {
    ($($name:ident),*) => {$(
        impl Sampler for $name<'static> {
            fn begin(&self, target: &impl Target) -> Result<Chains, RunError> {
                self.run(target)
            }

            fn go_on(&self, target: &impl Target, earlier: Chains) -> Result<Chains, RunError> {
                self.resume(target, earlier)
            }

            fn until(self, flag: &'static AtomicBool) -> Self {
                self.interrupt(flag)
            }
        }
    )*};
}
samplers!(Nuts, Metropolis);

/// Delayed acceptance with the screening density as the second field.
#[derive(Clone)]
struct Screened<'a>(DelayedAcceptance<'static>, &'a Gaussian);

impl Sampler for Screened<'_> {
    fn begin(&self, target: &impl Target) -> Result<Chains, RunError> {
        self.0.run(self.1, target)
    }

    fn go_on(&self, target: &impl Target, earlier: Chains) -> Result<Chains, RunError> {
        self.0.resume(self.1, target, earlier)
    }

    fn until(self, flag: &'static AtomicBool) -> Self {
        Self(self.0.interrupt(flag), self.1)
    }
}

fn nuts() -> Nuts<'static> {
    Nuts::default().chains(3).warmup(120).seed(5)
}

fn saved_and_loaded(chains: &Chains) -> Chains {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("chains.json");
    chains.save(&path).expect("written");
    Chains::load(&path).expect("read")
}

/// N + M draws equal N draws that are saved, loaded and resumed for M, with all three kinds of map, with and without
/// thinning, and on any number of threads.
#[test]
fn a_resumed_run_is_the_longer_run_bit_for_bit() {
    let independent = Gaussian::autoregressive(3, 0.0, 0.1, 10.0);
    let correlated = Gaussian::autoregressive(5, 0.9, 0.1, 10.0);
    let many = Gaussian::equicorrelated(60, 0.9, 0.1, 10.0);
    for (target, thin) in [(independent, 1), (correlated, 3), (many, 1)] {
        let nuts = nuts().thin(thin);
        let long = nuts.clone().draws(70).run(&target).expect("runs");
        let short = nuts.clone().draws(40).run(&target).expect("runs");
        let loaded = saved_and_loaded(&short);
        assert_eq!(loaded, short);
        let resumed = nuts.clone().draws(70).threads(2).resume(&target, loaded).expect("resumes");
        assert_eq!(resumed, long);
        // the run is complete, and resuming it changes nothing
        assert_eq!(nuts.draws(50).resume(&target, long.clone()).expect("resumes"), long);
    }
}

/// A resumed run continues the counts of rejections and the indices of divergences, and the file preserves infinite
/// energy errors.
#[test]
fn counts_go_on_too() {
    let start = vec![vec![1.0]; 3];
    let nuts = nuts().init_points(start);
    let long = nuts.clone().draws(400).run(&half_normal()).expect("runs");
    let short = nuts.clone().draws(150).run(&half_normal()).expect("runs");
    assert!(short.divergences() > 0 && short.chains.iter().all(|c| !c.rejections.is_empty()));
    let places: Vec<&Location> = short.chains.iter().flat_map(|c| c.rejections.keys()).collect();
    let loaded = saved_and_loaded(&short);
    let again: Vec<&Location> = loaded.chains.iter().flat_map(|c| c.rejections.keys()).collect();
    assert_eq!(places, again);
    assert_eq!(nuts.draws(400).resume(&half_normal(), loaded).expect("resumes"), long);
}

/// The chains of a run and the number of its density evaluations.
fn counted(sampler: &impl Sampler, target: &impl Target) -> (Chains, usize) {
    let count = AtomicUsize::new(0);
    let watched = until(target, 0, || {
        count.fetch_add(1, Ordering::Relaxed);
        Ok(())
    });
    let chains = sampler.begin(&watched).expect("runs");
    (chains, count.load(Ordering::Relaxed))
}

/// The chains of a run that is interrupted at the evaluation with index `evaluation`, saved and loaded.
fn interrupted(
    sampler: &impl Sampler,
    target: &impl Target,
    evaluation: usize,
    earlier: Option<Chains>,
) -> Chains {
    let flag: &AtomicBool = Box::leak(Box::default());
    let watched = until(target, evaluation, || {
        flag.store(true, Ordering::Relaxed);
        Ok(())
    });
    let sampler = sampler.clone().until(flag);
    let chains = match earlier {
        None => sampler.begin(&watched),
        Some(earlier) => sampler.go_on(&watched, earlier),
    };
    saved_and_loaded(&chains.expect("runs"))
}

/// The same sampler finishes a run that was interrupted twice, at any evaluation (before the first transition, in the
/// warmup, while drawing), with all kinds of map, with rejections, and with or without thinning.
#[test]
fn an_interrupted_run_is_finished() {
    let start = vec![vec![1.0]; 2];
    let nuts = |nuts: Nuts<'static>| nuts.chains(2).threads(1).warmup(200).draws(300).seed(3);
    let plain = Gaussian::autoregressive(3, 0.0, 0.1, 10.0);
    finished(&nuts(Nuts::stan_compatible()), &plain);
    finished(&nuts(Nuts::default()).thin(3), &Gaussian::autoregressive(5, 0.9, 0.1, 10.0));
    finished(&nuts(Nuts::default()), &Gaussian::equicorrelated(60, 0.9, 0.1, 10.0));
    finished(&nuts(Nuts::default()).thin(3).init_points(start), &half_normal());
}

/// An interrupted run of a sampler without gradients is finished, too: the warmup continues with its scales and
/// windows, and the draws use the adapted scales.
#[test]
fn walks_go_on_too() {
    macro_rules! settings {
        ($sampler:expr) => {
            $sampler.chains(2).threads(1).warmup(200).draws(300).seed(3)
        };
    }
    let target = Gaussian::autoregressive(3, 0.6, 0.1, 10.0);
    let start = vec![vec![1.0]; 2];
    let walk = settings!(Metropolis::default());
    finished(&walk, &target);
    finished(&walk.thin(3).init_points(start), &half_normal());
    let cheap = Gaussian::autoregressive(3, 0.3, 0.1, 12.0);
    let screened = settings!(DelayedAcceptance::default()).screening_steps(3).plain_share(0.2);
    finished(&Screened(screened.clone(), &cheap), &target);
    // with a warmup that mostly evaluates the screening density alone
    finished(&Screened(screened.screened_warmup(120), &cheap), &target);
}

fn finished(sampler: &impl Sampler, target: &impl Target) {
    let (whole, evaluations) = counted(sampler, target);
    let mut lengths = Vec::new();
    for part in 0..20 {
        let cut = interrupted(sampler, target, evaluations * part / 20, None);
        assert!(cut.chains.iter().any(|c| c.stopped.is_some()));
        lengths.extend(cut.chains.iter().map(|c| (c.warmup.stats.len(), c.len())));
        let again = interrupted(sampler, target, evaluations / 12, Some(cut));
        let resumed = sampler.go_on(target, again).expect("resumes");
        assert_eq!(resumed, whole, "after {part} twentieths");
    }
    assert!(lengths.contains(&(0, 0)), "{lengths:?}");
    assert!(lengths.iter().any(|(tuned, _)| (1..200).contains(tuned)), "{lengths:?}");
    assert!(lengths.iter().any(|(_, drawn)| (1..300).contains(drawn)), "{lengths:?}");
}

#[test]
fn an_interrupt_between_warmup_and_draws_loses_nothing() {
    let nuts = nuts().chains(1);
    let target = Gaussian::autoregressive(3, 0.0, 0.1, 10.0);
    let (first, evaluations) = counted(&nuts.clone().draws(1), &target);
    let last_of_warmup = evaluations - first.chains[0].stats[0].leapfrogs as usize - 1;
    let cut = interrupted(&nuts, &target, last_of_warmup, None);
    assert_eq!((cut.chains[0].warmup.stats.len(), cut.len()), (120, 0));
    let whole = nuts.run(&target).expect("runs");
    assert_eq!(nuts.resume(&target, cut).expect("resumes"), whole);
}

/// Chains that no run can have written are refused before they are used.
#[test]
fn damaged_warmups_are_named() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let nuts = nuts().chains(1);
    let paused = interrupted(&nuts, &target, 100, None);
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("chains.json");
    paused.save(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    let done = paused.chains[0].warmup.stats.len();
    assert!((1..120).contains(&done) && Chains::load(&path).is_ok());
    let damages = [
        ("\"length\":120".to_owned(), "\"length\":18446744073709551615"),
        ("\"length\":120".to_owned(), "\"length\":1"),
        (format!("\"draw\":{done}}}"), "\"draw\":18446744073709551615}"),
        ("\"position\":[".to_owned(), "\"position\":[0.5,"),
        ("\"max_depth\":10".to_owned(), "\"max_depth\":4000000000"),
    ];
    for (right, wrong) in damages {
        assert!(text.contains(&right), "{right}");
        std::fs::write(&path, text.replacen(&right, wrong, 1)).expect("written");
        let loaded = Chains::load(&path);
        assert!(matches!(loaded, Err(ChainsFileError::Damaged { .. })), "{wrong}: {loaded:?}");
    }
    // chains that were changed in memory are refused, too
    let mut shortened = paused;
    shortened.chains[0].warmup.stats.pop();
    let error = nuts.resume(&target, shortened).expect_err("does not fit");
    assert!(error.to_string().contains("warmup of chain 0"), "{error}");
}

#[test]
fn chains_that_do_not_fit_are_refused_by_reason() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let other = Gaussian::autoregressive(2, 0.6, 0.5, 3.0);
    let wide = Gaussian::autoregressive(3, 0.6, 0.5, 2.0);
    let nuts = nuts().draws(20);
    let chains = nuts.run(&target).expect("runs");
    let walk = Metropolis::default().chains(3).draws(20).run(&target).expect("runs");
    let fail = || Err(Rejection::fatal("the licence server is gone"));
    let one = nuts.clone().chains(1);
    let failed = one.run(&normal_until(2, 50, fail)).expect("runs");
    let mut broken = chains.clone();
    broken.chains[1].warmup.covariance = InverseMassMatrix::Dense(vec![1.0, 2.0, 2.0, 1.0]);
    let cases = [
        (nuts.resume(&other, chains.clone()), "log density"),
        (nuts.resume(&wide, chains.clone()), "2 coordinates but the density has 3"),
        (nuts.clone().chains(2).resume(&target, chains.clone()), "there are 3"),
        (nuts.resume(&target, walk), "another sampler"),
        (one.resume(&target, failed), "chain 0 failed in its warmup"),
        (nuts.resume(&target, broken), "not positive"),
    ];
    for (result, words) in cases {
        let error = result.expect_err(words);
        assert!(matches!(&error, RunError::Resume { .. }), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}

/// Every sampler refuses the chains of another sampler, of another density or of other settings.
#[test]
fn walks_refuse_what_is_not_theirs() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let other = Gaussian::autoregressive(2, 0.6, 0.5, 3.0);
    let walk = Metropolis::default().chains(2).warmup(50).draws(20);
    let delayed = DelayedAcceptance::default().chains(2).warmup(50).draws(20);
    let chains = walk.run(&target).expect("runs");
    let gradients = Nuts::default().chains(2).draws(20).run(&target).expect("runs");
    let screened = delayed.run(&other, &target).expect("runs");
    let cases = [
        (walk.resume(&target, gradients.clone()), "another sampler"),
        (walk.resume(&target, screened.clone()), "another sampler"),
        (walk.resume(&other, chains.clone()), "log density"),
        (delayed.resume(&other, &target, chains), "another sampler"),
        (
            delayed.clone().screening_steps(2).resume(&other, &target, screened.clone()),
            "they took 1 screening steps",
        ),
        (
            delayed.screening_power(0.5).resume(&other, &target, screened),
            "a density to the power 1,",
        ),
    ];
    for (result, words) in cases {
        let error = result.expect_err(words);
        assert!(matches!(&error, RunError::Resume { .. }), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn damaged_files_are_named() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let chains = nuts().draws(20).run(&target).expect("runs");
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("chains.json");
    let load = |text: &str| {
        std::fs::write(&path, text).expect("written");
        let error = Chains::load(&path).expect_err("refused");
        assert!(error.to_string().contains("chains.json"), "{error}");
        error
    };
    assert!(matches!(load("{\"format\": \"ppl chains 0\"}"), ChainsFileError::Format { .. }));
    assert!(matches!(load("{\"draws\": 3}"), ChainsFileError::Format { .. }));
    chains.save(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read");
    let half = &text[..text.len() / 2];
    assert!(matches!(load(half), ChainsFileError::Damaged { .. }));
    let fewer = text.replacen("\"dim\":2", "\"dim\":3", 1);
    assert!(matches!(load(&fewer), ChainsFileError::Damaged { .. }));
    let nowhere = directory.path().join("no directory").join("chains.json");
    assert!(matches!(chains.save(&nowhere), Err(ChainsFileError::File { action: "write", .. })));
    assert!(matches!(Chains::load(&nowhere), Err(ChainsFileError::File { action: "read", .. })));
}
