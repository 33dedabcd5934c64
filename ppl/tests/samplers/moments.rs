//! Means and variances within four standard errors; a correct sampler fails one of 16 000 such
//! checks.

use ppl::check::{CheckFailure, Estimate};
use ppl::{Metropolis, Nuts};

use crate::targets::{
    Function, Gaussian, WALL, assert_gaussian_moments, assert_mean, half_normal, mean_and_error,
    two_modes,
};

#[test]
fn nuts_on_correlated_gaussians() {
    let targets = [
        Gaussian::autoregressive(2, 0.95, 1.0, 30.0),
        Gaussian::autoregressive(10, 0.8, 0.01, 100.0),
    ];
    for target in targets {
        for nuts in [Nuts::default(), Nuts::stan_compatible()] {
            let chains = nuts.seed(2).draws(2000).run(&target).expect("runs");
            assert_gaussian_moments(&target, &chains);
            assert_eq!(chains.divergences(), 0);
        }
    }
}

#[test]
fn metropolis_on_correlated_gaussians() {
    let targets = [
        Gaussian::autoregressive(2, 0.95, 1.0, 30.0),
        Gaussian::autoregressive(10, 0.8, 0.01, 100.0),
    ];
    for target in targets {
        let metropolis = Metropolis::default().warmup(10_000).draws(4000).thin(25).seed(3);
        let chains = metropolis.run(&target).expect("runs");
        assert_gaussian_moments(&target, &chains);
    }
}

/// A skewed, curved target without closed moments: y₀ has the density of ln Exponential(1), y₁ lies around a parabola
/// in y₀.
#[test]
fn metropolis_and_nuts_agree() {
    let target = Function {
        dim: 2,
        function: |y: &[f64], g: &mut [f64]| {
            let bend = y[1] - 0.5 * y[0] * y[0];
            g[0] = 1.0 - y[0].exp() + bend * y[0];
            g[1] = -bend;
            Ok(y[0] - y[0].exp() - 0.5 * bend * bend)
        },
    };
    let nuts = Nuts::default().draws(4000).seed(1).target_accept(0.95).run(&target).expect("runs");
    let metropolis = Metropolis::default().draws(4000).thin(10).seed(1).run(&target).expect("runs");
    type Statistic = fn(&[f64]) -> f64;
    let statistics: [Statistic; 4] = [|y| y[0], |y| y[1], |y| y[0] * y[0], |y| y[0] * y[1]];
    for (i, statistic) in statistics.into_iter().enumerate() {
        let (a, error_a) = mean_and_error(&nuts, statistic);
        let (b, error_b) = mean_and_error(&metropolis, statistic);
        let error = error_a.hypot(error_b);
        assert!((a - b).abs() < 4.0 * error, "statistic {i}: {a} and {b} ± {error}");
    }
    // the mean of ln Exponential(1) is −γ
    assert_mean("y0", &nuts, -0.577_215_664_901_532_9, |y| y[0]);
}

/// Points outside the support are rejected and counted; inside, the draws are right.
#[test]
fn a_density_with_a_wall() {
    let target = half_normal();
    let mean = (2.0 / std::f64::consts::PI).sqrt();
    let start = vec![vec![1.0]; 4];
    let nuts = Nuts::default().init_points(start).draws(4000).seed(4).run(&target).expect("runs");
    let metropolis = Metropolis::default().draws(4000).thin(5).seed(4).run(&target).expect("runs");
    for chains in [nuts, metropolis] {
        assert_mean("mean", &chains, mean, |y| y[0]);
        assert_mean("square", &chains, 1.0, |y| y[0] * y[0]);
        for chain in &chains.chains {
            assert_eq!(chain.rejections.keys().collect::<Vec<_>>(), [&WALL]);
            assert!(chain.rejections[&WALL] > 0);
            assert_eq!(chain.divergences.len(), chain.stats.iter().filter(|s| s.divergent).count());
        }
    }
}

/// Points where a density returns infinity or NaN instead of a rejection are rejected too.
#[test]
fn infinite_densities_are_rejected_points() {
    let target = Function {
        dim: 1,
        function: |y: &[f64], _: &mut [f64]| {
            Ok(match y[0] {
                y if y > 2.0 => f64::NAN,
                y if y < -2.0 => f64::INFINITY,
                y => -0.5 * y * y,
            })
        },
    };
    let chains = Metropolis::default().run(&target).expect("runs");
    let draws = chains.chains.iter().flat_map(|chain| &chain.draws);
    assert!(draws.into_iter().all(|y| y.abs() <= 2.0));
    assert!(chains.chains.iter().all(|chain| !chain.rejections.is_empty()));
}

/// Neal's funnel in ten dimensions: the sampler cannot enter its neck, and the divergences lie there.
#[test]
fn a_funnel_diverges_in_its_neck() {
    let funnel = Function {
        dim: 10,
        function: |y: &[f64], g: &mut [f64]| {
            let precision = (-y[0]).exp();
            let squares: f64 = y[1..].iter().map(|x| x * x).sum();
            g[0] = -y[0] / 9.0 - 4.5 + 0.5 * precision * squares;
            y[1..].iter().zip(&mut g[1..]).for_each(|(x, g)| *g = -precision * x);
            Ok(-y[0] * y[0] / 18.0 - 4.5 * y[0] - 0.5 * precision * squares)
        },
    };
    let mut neck = Vec::new();
    for seed in 1..=8 {
        let chains = Nuts::stan_compatible().seed(seed).run(&funnel).expect("runs");
        for divergence in chains.chains.iter().flat_map(|c| &c.divergences) {
            assert!(divergence.energy_error > 1000.0);
            neck.push(divergence.position[0]);
        }
    }
    assert!(neck.len() > 50);
    let deep = neck.iter().filter(|&&v| v < 0.0).count();
    assert!(2 * deep > neck.len(), "only {deep} of {} below 0", neck.len());
}

/// Of two modes 20 standard deviations apart every chain visits one: the check of the mean fails for every expected
/// value, although the standard error would allow each expected value.
#[test]
fn chains_in_separate_modes_confirm_no_mean() {
    let target = two_modes(1, 10.0, 0.5);
    let starts = vec![vec![10.0], vec![-10.0], vec![10.0], vec![10.0]];
    let chains = Nuts::default().init_points(starts).seed(3).run(&target).expect("runs");
    let traces = chains.traces(0);
    let traces: Vec<&[f64]> = traces.iter().map(Vec::as_slice).collect();
    assert!(ppl::diagnostics::rhat(&traces) > 1.5);
    for claimed in [0.0, 3.0, 6.0, -9.0] {
        let estimate = Estimate::of_mean("x", &traces, claimed);
        assert!(estimate.sigmas() < 6.0, "{}", estimate.sigmas());
        let failure = estimate.check(4.0).expect_err("two modes");
        assert!(matches!(failure, CheckFailure::Unmixed { .. }), "{failure}");
    }
}

/// The moment check must fail for a sampler with a wrong mean.
#[test]
#[should_panic(expected = "mean 0")]
fn a_shifted_sample_is_caught() {
    let target = Gaussian::autoregressive(2, 0.5, 1.0, 1.0);
    let mut chains = Nuts::default().seed(2).run(&target).expect("runs");
    chains.chains.iter_mut().for_each(|c| c.draws.iter_mut().for_each(|y| *y += 0.2));
    assert_gaussian_moments(&target, &chains);
}
