//! Tempered sequential Monte Carlo: modes with their weights, and the evidence against closed
//! forms, within its own standard error.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use ppl::special::ln_beta;
use ppl::{ChainStatus, Evidence, Parts, Place, Progress, Rejection, SampleError, Tempered, check};

use crate::targets::assert_mean;

ppl::model! {
    /// Conjugate: mean and evidence are known.
    fn level(y: &[f64], sd: f64) {
        let mu ~ Normal(1.0, 3.0);
        for y in y {
            y ~ Normal(mu, sd);
        }
    }
}

ppl::model! {
    fn coin(flips: &[bool]) {
        let p ~ Beta(2.0, 3.0);
        for flip in flips {
            flip ~ Bernoulli(p);
        }
    }
}

ppl::model! {
    /// Three independent levels, each with one datum.
    fn levels(y: &[f64; 6]) {
        let mu ~ Normal(0.0, 2.0).array::<6>();
        for i in 0..6 {
            y[i] ~ Normal(mu[i], 0.1);
        }
    }
}

ppl::model! {
    /// A likelihood with 30 % of its mass at −4 and 70 % at 4, both narrow, in two dimensions.
    fn bimodal() {
        let x ~ Uniform(-10.0, 10.0).array::<2>();
        let left = (0.3f64).ln() - 12.5 * ((x[0] + 4.0).powi(2) + (x[1] + 4.0).powi(2));
        let right = (0.7f64).ln() - 12.5 * ((x[0] - 4.0).powi(2) + (x[1] - 4.0).powi(2));
        let gap = (left - right).abs();
        factor(0.5 * (left + right + gap) + (-gap).exp().ln_1p());
    }
}

ppl::model! {
    /// No density for x < 0: half of the prior draws are rejected.
    fn half(y: f64) {
        let x ~ Normal(0.0, 1.0);
        factor(0.0 * x.ln());
        y ~ Normal(0.0, 1.0);
    }
}

/// ln of the normal density of a vector with covariance `noise² I + prior² 1 1ᵀ` about `mean`.
fn conjugate(y: &[f64], mean: f64, prior: f64, noise: f64) -> f64 {
    let n = y.len() as f64;
    let (v, w) = (noise * noise, prior * prior);
    let sum: f64 = y.iter().map(|y| y - mean).sum();
    let squares: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
    let quadratic = (squares - w * sum * sum / (v + n * w)) / v;
    let ln_det = (n - 1.0) * v.ln() + (v + n * w).ln();
    -0.5 * (n * (2.0 * std::f64::consts::PI).ln() + ln_det + quadratic)
}

#[track_caller]
fn assert_evidence(evidence: &Evidence, exact: f64) {
    let z = (evidence.ln - exact) / evidence.standard_error;
    // a t with 7 degrees of freedom passes 5.5 once in 1 000
    assert!(z.abs() < 5.5, "{} ± {}, exactly {exact}", evidence.ln, evidence.standard_error);
    assert!(evidence.standard_error < 0.15, "{}", evidence.standard_error);
}

#[test]
fn evidence_of_conjugate_models() {
    let y = [2.9, 3.4, 2.2, 3.8, 2.7];
    let result = Smc::default().seed(1).sample(&level(&y, 0.8)).expect("samples");
    assert_evidence(&result.evidence, conjugate(&y, 1.0, 3.0, 0.8));
    let precision = 1.0 / 9.0 + 5.0 / 0.64;
    let mean = (1.0 / 9.0 + y.iter().sum::<f64>() / 0.64) / precision;
    check::mean(&result.draws, "mu", mean).within_mcse(4.0);
    check::sd(&result.draws, "mu", precision.sqrt().recip()).within_mcse(4.0);

    let flips = [true, false, true, true, false, true, true, true, false, true];
    let result = Smc::default().seed(2).sample(&coin(&flips)).expect("samples");
    assert_evidence(&result.evidence, ln_beta(9.0, 6.0) - ln_beta(2.0, 3.0));
    check::mean(&result.draws, "p", 9.0 / 15.0).within_mcse(4.0);

    let y = [0.5, -1.0, 2.0, 0.1, -3.0, 1.4];
    let result = Smc::default().seed(3).sample(&levels(&y)).expect("samples");
    let exact: f64 = y.iter().map(|y| conjugate(&[*y], 0.0, 2.0, 0.1)).sum();
    assert_evidence(&result.evidence, exact);
    check::mean(&result.draws, "mu[4]", -3.0 * 4.0 / 4.01).within_mcse(4.0);
}

/// Over 40 seeds, half of the errors should lie within the quartiles of a t with 7 degrees of
/// freedom, ± 0.711 standard errors: Binomial(40, ½) leaves (8, 32) once in 20 000. The same for
/// the posterior mean and its Monte Carlo standard error, within ± 0.674.
#[test]
fn standard_errors_are_honest() {
    let y = [2.9, 3.4, 2.2];
    let exact = conjugate(&y, 1.0, 3.0, 0.8);
    let precision = 1.0 / 9.0 + 3.0 / 0.64;
    let mean = (1.0 / 9.0 + 8.5 / 0.64) / precision;
    let (mut evidence, mut moments) = (0, 0);
    for seed in 0..40 {
        let smc = Smc::default().particles(200).seed(seed);
        let result = smc.sample(&level(&y, 0.8)).expect("samples");
        let error = (result.evidence.ln - exact) / result.evidence.standard_error;
        evidence += u32::from(error.abs() < 0.711);
        moments += u32::from(check::mean(&result.draws, "mu", mean).sigmas() < 0.674);
    }
    assert!((8..=32).contains(&evidence), "{evidence} of 40");
    assert!((8..=32).contains(&moments), "{moments} of 40");
}

#[test]
fn two_modes_keep_their_weights() {
    let result = Smc::default().seed(4).sample(&bimodal()).expect("samples");
    // each mode integrates to its weight times 2 π/25, over a prior density of 1/400
    let exact = (2.0 * std::f64::consts::PI / 25.0 / 400.0).ln();
    assert_evidence(&result.evidence, exact);
    check::mean(&result.draws, "x[0]", 4.0 * 0.4).within_mcse(4.0);
    let x = result.draws.trace("x[1]").expect("named");
    let right: Vec<Vec<f64>> =
        x.iter().map(|x| x.iter().map(|x| f64::from(u8::from(*x > 0.0))).collect()).collect();
    let slices: Vec<&[f64]> = right.iter().map(Vec::as_slice).collect();
    check::Estimate::of_mean("weight", &slices, 0.7).within_mcse(4.0);
}

/// What the prior draws and the density rejects counts in the evidence.
#[test]
fn rejected_prior_draws_lower_the_evidence() {
    let result = Smc::default().seed(5).sample(&half(0.3)).expect("samples");
    assert_evidence(&result.evidence, 0.5f64.ln() + Normal(0.0, 1.0).ln_density(&0.3));
    check::mean(&result.draws, "x", (2.0 / std::f64::consts::PI).sqrt()).within_mcse(4.0);
    assert!(result.draws.rejections().values().any(|&(before, _)| before > 0));
}

#[test]
fn temperatures_rise_to_one() {
    let y = [0.5, -1.0, 2.0, 0.1, -3.0, 1.4];
    let result = Smc::default().particles(300).sample(&levels(&y)).expect("samples");
    for way in &result.stages {
        assert!(way.windows(2).all(|w| w[0].temperature < w[1].temperature));
        assert_eq!(way.last().expect("stages").temperature, 1.0);
        for stage in &way[..way.len() - 1] {
            approx::assert_relative_eq!(stage.ess, 150.0, max_relative = 1e-3);
        }
        assert!(way.iter().all(|s| s.sweeps as f64 * s.acceptance >= 6.0));
    }
    let sweeps: usize = result.stages.iter().flatten().map(|s| s.sweeps).sum();
    assert_eq!(result.draws.chains.evaluations(), 300 * (sweeps + 8) as u64);
}

#[test]
fn draws_do_not_depend_on_the_number_of_threads() {
    let model = level(&[2.9, 3.4], 0.8);
    let smc = Smc::default().particles(100).runs(3).seed(9);
    let one = smc.clone().threads(1).run(&model).expect("runs");
    let two = smc.threads(2).run(&model).expect("runs");
    assert_eq!(one.draws, two.draws);
    assert_eq!(one.evidence, two.evidence);
}

#[test]
fn bad_settings_and_interrupts_are_named() {
    let model = level(&[2.9, 3.4], 0.8);
    let cases = [
        (Smc::default().runs(1), "runs"),
        (Smc::default().particles(10), "particles"),
        (Smc::default().ess_fraction(1.0), "ess_fraction"),
        (Smc::default().ess_fraction(f64::NAN), "ess_fraction"),
        (Smc::default().jumps(0), "jumps"),
        (Smc::default().threads(0), "threads"),
    ];
    for (smc, name) in cases {
        let error = smc.run(&model).expect_err(name);
        assert!(
            matches!(error, SampleError::Setting { setting, .. } if setting == name),
            "{error}"
        );
    }

    let flag = AtomicBool::new(true);
    let error = Smc::default().interrupt(&flag).run(&model).expect_err("interrupted");
    assert!(matches!(error, SampleError::Tempering { .. }), "{error}");
    assert!(error.to_string().contains("before the posterior: interrupted"), "{error}");
}

#[derive(Default)]
struct Log(Mutex<Vec<ChainStatus>>);

impl Progress for Log {
    fn update(&self, status: &ChainStatus) {
        self.0.lock().expect("no panic").push(*status);
    }
}

#[test]
fn every_run_reports_its_end_once() {
    let log = Log::default();
    let flag = AtomicBool::new(false);
    let smc = Smc::default().particles(100).runs(3).progress(&log).interrupt(&flag);
    smc.run(&level(&[2.9, 3.4], 0.8)).expect("runs");
    assert!(!flag.load(Ordering::Relaxed));
    let log = log.0.into_inner().expect("no panic");
    for run in 0..3 {
        let ends: Vec<_> = log.iter().filter(|s| s.chain == run && s.finished).collect();
        assert_eq!(ends.len(), 1);
        assert_eq!((ends[0].done, ends[0].total, ends[0].tuning), (1000, 1000, false));
    }
}

/// A prior uniform on (−10, 10)⁵ and any likelihood.
struct InABox<F>(F);

impl<F: Fn(&[f64]) -> Result<f64, Rejection> + Sync> Tempered for InABox<F> {
    fn unknowns(&self) -> usize {
        5
    }

    fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Vec<f64>, Rejection> {
        Ok((0..5).map(|_| rng.random_range(-10.0..10.0)).collect())
    }

    fn parts(&self, y: &[f64]) -> Result<Parts, Rejection> {
        let inside = y.iter().all(|y| y.abs() < 10.0);
        let ln_prior = if inside { -5.0 * 20f64.ln() } else { f64::NEG_INFINITY };
        Ok(Parts { ln_prior, ln_likelihood: self.0(y)? })
    }
}

/// Ten standard deviations apart and of different widths, so that the narrow mode, with a quarter of
/// the mass, holds few of the early particles.
#[test]
fn modes_of_different_widths() {
    let normal =
        |y: &[f64], at: f64, sd: f64| y.iter().map(|y| Normal(at, sd).ln_density(y)).sum::<f64>();
    let target = InABox(|y: &[f64]| {
        let (wide, narrow) =
            (normal(y, 4.0, 0.8) + 0.75f64.ln(), normal(y, -4.0, 0.4) + 0.25f64.ln());
        Ok(wide.max(narrow) + (-(wide - narrow).abs()).exp().ln_1p())
    });
    let result = Smc::default().particles(2000).seed(6).run(&target).expect("runs");
    let z = (result.evidence.ln + 5.0 * 20f64.ln()) / result.evidence.standard_error;
    assert!(z.abs() < 5.5, "{:?}", result.evidence);
    assert_mean("share", &result.draws, 0.25, |y| f64::from(u8::from(y[0] < 0.0)));
    assert_mean("mean", &result.draws, 2.0, |y| y[4]);
    let wide = |y: &[f64]| if y[0] > 0.0 { (y[3] - 4.0).powi(2) } else { 0.64 };
    assert_mean("variance of the wide mode", &result.draws, 0.64, wide);
}

#[test]
fn failures_say_where_and_why() {
    let calls = AtomicU64::new(0);
    let failing = InABox(|_: &[f64]| match calls.fetch_add(1, Ordering::Relaxed) {
        0..5_000 => Ok(0.0),
        _ => Err(Rejection::Fatal { message: "the licence server is gone".into() }),
    });
    // the first run fails while its particles move, the others before they start
    let error = Smc::default().threads(1).run(&failing).expect_err("stops");
    assert!(matches!(error, SampleError::Tempering { run: 0, .. }), "{error}");
    assert!(error.to_string().contains("licence server"), "{error}");

    let place = Place { statement: "y > 0", file: "smc.rs", line: 1 };
    let nowhere = InABox(|_: &[f64]| Err(Rejection::NotFinite { place, value: f64::NAN }));
    let error = Smc::default().run(&nowhere).expect_err("no start");
    assert!(matches!(error, SampleError::Initialisation { tries: 10_000, .. }), "{error}");
    assert!(error.to_string().contains("`y > 0` (smc.rs:1)"), "{error}");
}
