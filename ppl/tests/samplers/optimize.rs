//! Modes and normal approximations against closed forms.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use nalgebra::{DMatrix, DVector};
use ppl::{Bound, Context, Laplace, Map, Model, OptimizeError, Rejection, Scalar, Site, Uniform};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::targets::Function;

fn density<F>(dim: usize, function: F) -> Function<F> {
    Function { dim, function }
}

/// The log-density of Rosenbrock's valley, rejected beyond |y| > 3; the mode is (1, 1).
fn rosenbrock(y: &[f64], g: &mut [f64]) -> Result<f64, Rejection> {
    if y.iter().any(|y| y.abs() > 3.0) {
        return Err(Rejection::NotFinite { location: ppl::Location::unknown(), value: f64::NAN });
    }
    let bend = y[1] - y[0] * y[0];
    g[0] = 2.0 * (1.0 - y[0]) + 400.0 * bend * y[0];
    g[1] = -200.0 * bend;
    Ok(-(1.0 - y[0]).powi(2) - 100.0 * bend * bend)
}

#[test]
fn a_curved_valley_between_walls() {
    let mode = Map::default().run(&density(2, rosenbrock)).expect("finds it");
    assert!(mode.converged && mode.at_bound.is_empty(), "{mode:?}");
    assert_eq!((mode.starts, mode.agreeing), (10, 10));
    assert_abs_diff_eq!(mode.point[0], 1.0, epsilon = 1e-3);
    assert_abs_diff_eq!(mode.point[1], 1.0, epsilon = 2e-3);
}

/// A normal with scales from 1e-4 to 1e4 and correlation 0.9: mean, covariance and evidence are exact.
#[test]
fn a_badly_scaled_gaussian() {
    let sd = [1e-4, 1.0, 1e4];
    let mean = [0.5, -2.0, 3e3];
    let covariance = DMatrix::from_fn(3, 3, |i, j| sd[i] * sd[j] * if i == j { 1.0 } else { 0.9 });
    let precision = covariance.clone().try_inverse().expect("positive definite");
    let target = density(3, |y: &[f64], g: &mut [f64]| {
        let z = DVector::from_fn(3, |i, _| y[i] - mean[i]);
        let pull = &precision * &z;
        g.copy_from_slice((-&pull).as_slice());
        Ok(4.5 - 0.5 * z.dot(&pull))
    });
    let laplace = Laplace::new(&target, &Map::default().seed(3)).expect("fits");
    assert!(laplace.mode.converged, "{:?}", laplace.mode);
    for i in 0..3 {
        assert_abs_diff_eq!(laplace.mode.point[i], mean[i], epsilon = 2e-3 * sd[i]);
        for j in 0..3 {
            let error = (laplace.covariance[(i, j)] - covariance[(i, j)]) / (sd[i] * sd[j]);
            assert_abs_diff_eq!(error, 0.0, epsilon = 1e-5);
        }
    }
    let exact = 4.5 + 0.5 * (3.0 * std::f64::consts::TAU.ln() + covariance.determinant().ln());
    assert_abs_diff_eq!(laplace.log_evidence, exact, epsilon = 1e-4);
}

/// The mean and covariance of 20 000 draws agree with the approximation within 4 standard errors.
#[test]
fn draws_of_the_approximation() {
    let target = density(2, |y: &[f64], g: &mut [f64]| {
        g[0] = -2.0 * y[0] + y[1];
        g[1] = -2.0 * y[1] + y[0];
        Ok(-y[0] * y[0] - y[1] * y[1] + y[0] * y[1])
    });
    let laplace = Laplace::new(&target, &Map::default()).expect("fits");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let n = 20_000.0_f64;
    let draws: Vec<_> = (0..20_000).map(|_| laplace.draw(&mut rng)).collect();
    let second = |i: usize, j: usize| draws.iter().map(|y| y[i] * y[j]).sum::<f64>() / n;
    // H = [[2, −1], [−1, 2]]: variances 2/3, covariance 1/3; var of a product σᵢ²σⱼ² + cov²
    assert_abs_diff_eq!(second(0, 0), 2.0 / 3.0, epsilon = 4.0 * (2.0_f64 * 4.0 / 9.0 / n).sqrt());
    assert_abs_diff_eq!(second(0, 1), 1.0 / 3.0, epsilon = 4.0 * (5.0_f64 / 9.0 / n).sqrt());
}

/// Two modes of different height: the starts do not agree, and the higher mode is reported.
#[test]
fn a_second_mode_shows_as_disagreement() {
    let target = density(1, |y: &[f64], g: &mut [f64]| {
        // double well −(y² − 1)² tilted towards +1
        g[0] = -4.0 * y[0] * (y[0] * y[0] - 1.0) + 0.3;
        Ok(-(y[0] * y[0] - 1.0).powi(2) + 0.3 * y[0])
    });
    let mode = Map::default().starts(20).run(&target).expect("finds it");
    assert!(mode.point[0] > 0.9 && mode.converged);
    assert!((1..20).contains(&mode.agreeing), "{}", mode.agreeing);
}

#[test]
fn a_saddle_or_a_slope_without_end_is_not_a_mode() {
    let slope = density(1, |_: &[f64], g: &mut [f64]| {
        g[0] = 1.0;
        Ok(0.0)
    });
    // the gradient contradicts the value, so no step is ever accepted
    assert!(!Map::default().run(&slope).expect("ends").converged);
}

/// p ~ Uniform(0, 1) with 7 successes in 10: the mode over p is 0.7; over logit p, with the Jacobian, it is
/// (7+1)/(10+2), where the negative second derivative is 12 · 2/3 · 1/3.
struct Coin {
    heads: u32,
    flips: u32,
}

impl Model for Coin {
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
        static P: Site = Site::new("p");
        static FLIPS: Site = Site::new("flips");
        let p = cx.unknown(&P, Uniform(0.0, 1.0))?;
        let tails = f64::from(self.flips - self.heads);
        cx.factor(&FLIPS, p.ln() * f64::from(self.heads))?;
        // avoids 0 · ln 0 at p = 1 without tails
        if tails > 0.0 { cx.factor(&FLIPS, (-p).ln_1p() * tails) } else { Ok(()) }
    }
}

fn logistic(y: f64) -> f64 {
    1.0 / (1.0 + (-y).exp())
}

#[test]
fn the_mode_of_a_model_ignores_the_jacobian_and_laplace_does_not() {
    let coin = Bound::new(Coin { heads: 7, flips: 10 });
    let mode = Map::default().find(&coin).expect("finds it");
    assert!(mode.converged && mode.at_bound.is_empty());
    assert_abs_diff_eq!(logistic(mode.point[0]), 0.7, epsilon = 1e-5);
    assert_relative_eq!(
        mode.log_density,
        7.0 * 0.7_f64.ln() + 3.0 * 0.3_f64.ln(),
        max_relative = 1e-12
    );
    let laplace = Laplace::new(&coin, &Map::default()).expect("fits");
    assert_abs_diff_eq!(logistic(laplace.mode.point[0]), 8.0 / 12.0, epsilon = 1e-5);
    assert_relative_eq!(laplace.covariance[(0, 0)], 9.0 / 24.0, max_relative = 1e-5);
}

/// With heads only, the likelihood increases up to the bound p = 1.
#[test]
fn a_mode_at_the_prior_bound_is_said_to_be_there() {
    let coin = Bound::new(Coin { heads: 10, flips: 10 });
    let mode = Map::default().find(&coin).expect("finds it");
    assert_eq!(mode.at_bound, [0]);
    assert!(mode.converged && mode.agreeing == 10, "{mode:?}");
    assert!(logistic(mode.point[0]) > 1.0 - 1e-6);
    assert_abs_diff_eq!(mode.log_density, 0.0, epsilon = 1e-6);
}

#[test]
fn failures_are_told_apart() {
    let nowhere = density(1, |_: &[f64], _: &mut [f64]| {
        Err(Rejection::NotFinite { location: ppl::Location::unknown(), value: f64::NAN })
    });
    let broken = density(1, |_: &[f64], _: &mut [f64]| Err(Rejection::fatal("gone")));
    assert!(matches!(Map::default().run(&nowhere), Err(OptimizeError::Start { tries: 100, .. })));
    assert!(matches!(Map::default().run(&broken), Err(OptimizeError::Density(_))));
    let none = Map::default().starts(0).run(&nowhere);
    assert!(matches!(none, Err(OptimizeError::Setting { setting: "starts", .. })));
}
