//! Estimates against references, gradient checks, leave-one-out cross-validation, finite differences.

use ppl::check::{CheckFailure, Estimate, GradientMismatch, gradient_at};
use ppl::diagnostics::{Loo, LooError, pareto_smooth};
use ppl::{Differentiable, DomainError, FiniteDifference, Group, LogDensity, Rejection, Values};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

fn normal_chains(seed: u64) -> Vec<Vec<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..4).map(|_| (0..250).map(|_| rng.sample(StandardNormal)).collect()).collect()
}

/// Of 600 means, sds and medians, 2 Φ(−2) = 4.55 % are more than two standard errors from the exact value; the test
/// allows four binomial standard errors.
#[test]
fn false_alarms_come_at_the_stated_rate() {
    let repetitions = 600;
    let mut alarms = [0; 3];
    for seed in 0..repetitions {
        let owned = normal_chains(seed);
        let chains: Vec<&[f64]> = owned.iter().map(Vec::as_slice).collect();
        let estimates = [
            Estimate::of_mean("x", &chains, 0.0),
            Estimate::of_sd("x", &chains, 1.0),
            Estimate::of_quantile("x", &chains, 0.5, 0.0),
        ];
        for (count, estimate) in alarms.iter_mut().zip(&estimates) {
            *count += u64::from(estimate.check(2.0).is_err());
        }
    }
    let expected = 0.0455 * repetitions as f64;
    let tolerance = 4.0 * (expected * (1.0 - 0.0455)).sqrt();
    for count in alarms {
        assert!((count as f64 - expected).abs() < tolerance, "{alarms:?}, about {expected}");
    }
}

#[test]
fn failures_tell_all_numbers() {
    let owned = normal_chains(1);
    let chains: Vec<&[f64]> = owned.iter().map(Vec::as_slice).collect();
    let failure = Estimate::of_mean("mu", &chains, 0.5).check(4.0).expect_err("far off");
    let words = failure.to_string();
    for part in ["mean of mu", "expected 0.5", "MCSE", "standard errors", "at most 4 are allowed"] {
        assert!(words.contains(part), "{words}");
    }
    // a reference value with standard error 1 agrees with the draws
    Estimate::of_mean("mu", &chains, 0.5).reference_error(1.0).within_mcse(4.0);
}

/// Chains in two modes fail the check of a mean, an sd and a median, whatever value is expected; a short chain with
/// strong autocorrelation fails the check too.
#[test]
fn chains_that_do_not_mix_confirm_nothing() {
    let mut owned = normal_chains(2);
    owned[3].iter_mut().for_each(|x| *x += 12.0);
    let chains: Vec<&[f64]> = owned.iter().map(Vec::as_slice).collect();
    for claimed in [0.0, 3.0, 6.0, -9.0] {
        for estimate in [
            Estimate::of_mean("x", &chains, claimed),
            Estimate::of_sd("x", &chains, claimed),
            Estimate::of_quantile("x", &chains, 0.5, claimed),
        ] {
            let failure = estimate.check(4.0).expect_err("not mixed");
            assert!(matches!(failure, CheckFailure::Unmixed { rhat, .. } if rhat > 1.3));
        }
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut x = 0.0;
    let mut slow = || {
        x = 0.95 * x + rng.sample::<f64, _>(StandardNormal);
        x
    };
    let chain: Vec<f64> = (0..1000).map(|_| slow()).collect();
    let failure = Estimate::of_mean("x", &[&chain], 0.0).check(f64::INFINITY);
    assert!(matches!(failure, Err(CheckFailure::Unmixed { .. })), "{failure:?}");
}

#[test]
fn a_constant_has_to_be_exact() {
    let constant = [2.0; 100];
    assert!(Estimate::of_mean("c", &[&constant], 2.0).check(4.0).is_ok());
    assert!(Estimate::of_mean("c", &[&constant], 2.1).check(4.0).is_err());
}

/// A normal model with known scale and a flat prior, for which p(y_i | y_−i) is normal in closed form.
#[test]
fn conjugate_normal_in_closed_form() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(77);
    let data: Vec<f64> = (0..20).map(|_| rng.sample(StandardNormal)).collect();
    let n = data.len() as f64;
    let centre = data.iter().sum::<f64>() / n;
    let draws = 8000;
    let half_log_tau = 0.5 * (2.0 * std::f64::consts::PI).ln();
    let mut log_likelihood = Vec::new();
    for _ in 0..draws {
        let mu = centre + rng.sample::<f64, _>(StandardNormal) / n.sqrt();
        log_likelihood.extend(data.iter().map(|y| -0.5 * (y - mu).powi(2) - half_log_tau));
    }
    let loo = Loo::new(4, draws / 4, data.len(), &log_likelihood).expect("valid input");
    let exact: f64 = data
        .iter()
        .map(|y| {
            let others = (n * centre - y) / (n - 1.0);
            let variance = 1.0 + 1.0 / (n - 1.0);
            -0.5 * (y - others).powi(2) / variance - half_log_tau - 0.5 * variance.ln()
        })
        .sum();
    // elpd sums 20 terms, each the log of a mean of 8000 ratios with relative sd 0.05 to 0.5
    assert!((loo.elpd - exact).abs() < 0.02, "{} against {exact}", loo.elpd);
    assert!(loo.unreliable().is_empty());
    assert!((loo.p_loo - 1.0).abs() < 0.6, "one parameter: {}", loo.p_loo);
}

#[test]
fn bad_input_is_named() {
    assert_eq!(Loo::new(4, 100, 0, &[]), Err(LooError::NoObservations));
    assert_eq!(Loo::new(1, 10, 1, &[0.0; 10]), Err(LooError::TooFewDraws { draws: 10 }));
    assert!(matches!(Loo::new(1, 30, 2, &[0.0; 30]), Err(LooError::Shape { .. })));
    let mut values = vec![-1.0; 60];
    values[5] = f64::NEG_INFINITY;
    let error = Loo::new(1, 30, 2, &values).expect_err("−∞");
    assert!(error.to_string().contains("observation 1"), "{error}");
}

#[test]
fn equal_ratios_need_no_smoothing() {
    let mut ratios = vec![2.0; 100];
    assert_eq!(pareto_smooth(&mut ratios, 1.0), f64::NEG_INFINITY);
    assert!((ratios[0] + 100_f64.ln()).abs() < 1e-14);
}

/// The functions x³ y and √x, defined for x ≥ 0 only.
fn black_box(&[x, y]: &[f64; 2]) -> Result<[f64; 2], DomainError> {
    DomainError::require(x >= 0.0, "black box", "x", "at least 0", x)?;
    Ok([x * x * x * y, x.sqrt()])
}

/// The error of a central difference of x³ y in x is h² y, the third derivative times h²/6.
#[test]
fn the_error_is_of_second_order() {
    for (step, allowed) in [(1e-2, 3.1e-4), (1e-3, 3.1e-6), (1e-4, 4e-8)] {
        let forward = FiniteDifference::new(black_box, [step; 2]).expect("positive steps");
        let (value, jacobian) = forward.value_and_jacobian(&[0.7, 3.0]).expect("inside");
        assert_eq!(value, black_box(&[0.7, 3.0]).expect("inside"));
        let exact = [[3.0 * 0.49 * 3.0, 0.343], [0.5 / 0.7_f64.sqrt(), 0.0]];
        for m in 0..2 {
            for d in 0..2 {
                let error = (jacobian[m][d] - exact[m][d]).abs();
                assert!(error < allowed, "{m} {d}: {error} at step {step}");
            }
        }
    }
}

#[test]
fn at_the_edge_of_the_domain_differences_are_one_sided() {
    let forward = FiniteDifference::new(black_box, [1e-3; 2]).expect("positive steps");
    let (_, jacobian) = forward.value_and_jacobian(&[5e-4, 2.0]).expect("inside");
    let expected = ((1.5e-3_f64).sqrt() - (5e-4_f64).sqrt()) / 1e-3;
    approx::assert_relative_eq!(jacobian[1][0], expected, max_relative = 1e-12);
    assert!(forward.value_and_jacobian(&[-1.0, 2.0]).is_err());
    assert!(forward.value(&[-1.0, 2.0]).is_err());
    assert!(FiniteDifference::new(black_box, [1e-3, 0.0]).is_err());
}

/// The log-density −y₀⁴/4 − y₁²/2, with the field added to the second component of its gradient.
struct Slipped(f64);

impl LogDensity for Slipped {
    type Workspace = ();
    fn dim(&self) -> usize {
        2
    }
    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-y[0].powi(4) / 4.0 - y[1] * y[1] / 2.0)
    }
    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = -y[0].powi(3);
        g[1] = -y[1] + self.0;
        self.log_density(y, w)
    }
}

/// The log-density −10¹⁰ (1 + 10⁻⁸ eʸ), whose rounding error makes its finite differences wrong by far more than 10⁻⁸.
struct Large;

impl LogDensity for Large {
    type Workspace = ();
    fn dim(&self) -> usize {
        1
    }
    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-1e10 * (1.0 + 1e-8 * y[0].exp()))
    }
    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = -1e2 * y[0].exp();
        self.log_density(y, w)
    }
}

#[test]
fn a_large_density_may_be_rounded() {
    ppl::check::gradient(&Large, 3);
}

#[test]
fn a_slip_of_1e7_is_found_and_named() {
    ppl::check::gradient(&Slipped(0.0), 3);
    let mismatch = gradient_at(&Slipped(1e-7), &[0.3, -1.1]).expect_err("a slip");
    assert!(matches!(mismatch, GradientMismatch::Component { coordinate: 1, .. }));
    assert!(mismatch.to_string().contains("∂/∂y[1]"), "{mismatch}");
}

#[test]
fn elements_are_named_last_dimension_fastest() {
    let names = |name: &str, shape: &[usize]| {
        Values { name: name.into(), shape: shape.to_vec(), data: Vec::new() }.elements()
    };
    assert_eq!(names("mu", &[]), ["mu"]);
    assert_eq!(names("sd", &[2]), ["sd[0]", "sd[1]"]);
    assert_eq!(names("m", &[2, 2]), ["m[0,0]", "m[0,1]", "m[1,0]", "m[1,1]"]);
    assert!(names("empty", &[0]).is_empty());
}

#[test]
fn traces_pick_one_element_of_every_draw() {
    let sd = Values { name: "sd".into(), shape: vec![2], data: (0..12).map(f64::from).collect() };
    let group = Group { chains: 2, draws: 3, variables: vec![sd] };
    assert_eq!(group.trace("sd[1]"), Some(vec![vec![1.0, 3.0, 5.0], vec![7.0, 9.0, 11.0]]));
    assert_eq!(group.trace("sd[2]"), None);
    assert_eq!(group.trace("mu"), None);
    assert_eq!(group.traces().count(), 2);
}
