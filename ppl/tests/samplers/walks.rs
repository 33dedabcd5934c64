//! Component-wise and differential-evolution Metropolis: moments within four standard errors, and
//! control as for the others.

use std::sync::atomic::AtomicBool;

use ppl::{
    Chains, ComponentwiseMetropolis, Covariance, DifferentialEvolution, LogDensity, Metropolis,
    SampleError,
};

use crate::targets::{
    Function, Gaussian, WALL, assert_gaussian_moments, assert_mean, half_normal, two_modes,
};

#[test]
fn componentwise_on_gaussians() {
    for (dim, rho, seed) in [(2, 0.8, 1), (5, 0.5, 2)] {
        let target = Gaussian::autoregressive(dim, rho, 0.01, 100.0);
        let sampler = ComponentwiseMetropolis::default().warmup(2000).draws(4000).thin(5);
        assert_gaussian_moments(&target, &sampler.seed(seed).run(&target).expect("runs"));
    }
}

#[test]
fn differential_evolution_on_gaussians() {
    for (dim, rho, seed) in [(2, 0.95, 1), (6, 0.8, 2)] {
        let target = Gaussian::autoregressive(dim, rho, 0.1, 10.0);
        let sampler = DifferentialEvolution::default().warmup(4000).draws(4000).thin(20);
        assert_gaussian_moments(&target, &sampler.seed(seed).run(&target).expect("runs"));
    }
}

#[test]
fn both_in_one_dimension_with_a_wall() {
    let mean = (2.0 / std::f64::consts::PI).sqrt();
    let componentwise = ComponentwiseMetropolis::default().thin(3).seed(4).run(&half_normal());
    let differential = DifferentialEvolution::default().thin(3).seed(4).run(&half_normal());
    for chains in [componentwise.expect("runs"), differential.expect("runs")] {
        assert_mean("mean", &chains, mean, |y| y[0]);
        assert_mean("square", &chains, 1.0, |y| y[0] * y[0]);
        assert!(chains.chains.iter().all(|chain| chain.rejections[&WALL] > 0));
    }
}

/// A fifth of the mass at −6, the rest at 6, in three dimensions: the population finds both, and the
/// chain jumps between them. Random-walk Metropolis stays where it began.
#[test]
fn differential_evolution_weighs_two_modes() {
    let target = two_modes(3, 6.0, 0.8);
    let right = |chains: &Chains, index: usize| {
        let draws = chains.chains[index].draws.chunks_exact(3);
        draws.filter(|y| y[0] > 0.0).count() as f64 / chains.len() as f64
    };
    let starts = vec![vec![6.0; 3], vec![-6.0; 3]];
    let walk = Metropolis::default().chains(2).init_points(starts.clone()).run(&target);
    let walk = walk.expect("runs");
    assert_eq!((right(&walk, 0), right(&walk, 1)), (1.0, 0.0));

    // points that both modes draw near: what an earlier search or the prior would give
    let archive = (0..40).map(|k| vec![if k % 2 == 0 { 6.0 } else { -6.0 } + 0.05 * k as f64; 3]);
    let sampler = DifferentialEvolution::default().population(20).archive(archive.collect());
    let chains = sampler.chains(4).draws(5000).thin(10).seed(3).run(&target).expect("runs");
    assert_mean("weight", &chains, 0.8, |y| f64::from(u8::from(y[0] > 0.0)));
    assert_mean("mean", &chains, 6.0 * 0.6, |y| y[2]);
}

/// Each coordinate's own scale is found, over eight orders of magnitude, at 2.4 standard
/// deviations, where a normal target accepts 44 %.
#[test]
fn componentwise_scales() {
    let target = Gaussian::autoregressive(4, 0.0, 1e-4, 1e4);
    let sampler = ComponentwiseMetropolis::default().warmup(20_000).draws(2000).seed(5);
    for chain in sampler.run(&target).expect("runs").chains {
        let Covariance::Diagonal(variances) = &chain.warmup.covariance else { panic!("diagonal") };
        for (i, variance) in variances.iter().enumerate() {
            let ratio = (variance / target.covariance[(i, i)]).sqrt();
            assert!((ratio - 2.4).abs() < 0.5, "{i}: {ratio}");
        }
        let mean = chain.stats.iter().map(|s| s.acceptance).sum::<f64>() / 2000.0;
        assert!((mean - 0.44).abs() < 0.05, "{mean}");
        assert!(chain.stats.iter().all(|s| s.leapfrogs == 4 && s.depth == 0));
    }
}

#[test]
fn draws_do_not_depend_on_the_number_of_threads() {
    let target = Gaussian::autoregressive(3, 0.6, 0.5, 2.0);
    let one = ComponentwiseMetropolis::default().chains(5).warmup(100).draws(50).seed(8);
    let two = DifferentialEvolution::default().chains(5).warmup(100).draws(50).seed(8);
    let first = one.clone().threads(1).run(&target).expect("runs");
    let second = two.clone().threads(1).run(&target).expect("runs");
    for threads in [2, 5] {
        assert_eq!(one.clone().threads(threads).run(&target).expect("runs"), first);
        assert_eq!(two.clone().threads(threads).run(&target).expect("runs"), second);
    }
    assert_ne!(first.chains[0].draws, first.chains[1].draws);
    assert_ne!(second.chains[0].draws, second.chains[1].draws);
}

/// The draws of a seed are part of the interface.
#[test]
fn the_stream_of_a_seed_is_fixed() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let one = ComponentwiseMetropolis::default().warmup(20).draws(10).seed(7).run(&target);
    let two = DifferentialEvolution::default().warmup(20).draws(10).seed(7).run(&target);
    let golden =
        [[-0.45268218121239284, 3.0841928278966604], [-1.1446323220674728, -2.9250211645303716]];
    for (chains, golden) in [one, two].into_iter().zip(golden) {
        let last = &chains.expect("runs").chains[1].draws[18..];
        for (value, golden) in last.iter().zip(golden) {
            approx::assert_relative_eq!(*value, golden, max_relative = 1e-8);
        }
    }
}

#[test]
fn no_unknowns() {
    let target = Function { dim: 0, function: |_: &[f64], _: &mut [f64]| Ok(-1.5) };
    let one = ComponentwiseMetropolis::default().draws(20).run(&target).expect("runs");
    let two = DifferentialEvolution::default().draws(20).run(&target).expect("runs");
    for chains in [one, two] {
        assert_eq!((chains.dim, chains.len()), (0, 20));
        let stats = chains.chains.iter().flat_map(|chain| &chain.stats);
        assert!(stats.into_iter().all(|s| s.log_density == -1.5 && s.acceptance == 1.0));
    }
}

/// A density that claims to be infinite or NaN somewhere, without rejecting, is not believed.
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
    let runs = [
        Metropolis::default().run(&target),
        ComponentwiseMetropolis::default().run(&target),
        DifferentialEvolution::default().run(&target),
    ];
    for chains in runs {
        let chains = chains.expect("runs");
        let draws = chains.chains.iter().flat_map(|chain| &chain.draws);
        assert!(draws.into_iter().all(|y| y.abs() <= 2.0));
        assert!(chains.chains.iter().all(|chain| !chain.rejections.is_empty()));
    }
}

#[test]
fn settings_and_interrupts() {
    let target = Gaussian::autoregressive(2, 0.6, 0.5, 2.0);
    let refused = |sampler: DifferentialEvolution<'_>, name: &str| {
        let error = sampler.run(&target).expect_err(name);
        assert!(
            matches!(error, SampleError::Setting { setting, .. } if setting == name),
            "{error}"
        );
    };
    refused(DifferentialEvolution::default().population(2), "population");
    refused(DifferentialEvolution::default().archive(vec![vec![0.0; 3]]), "archive");
    refused(DifferentialEvolution::default().draws(0), "draws");
    assert_eq!(target.dim(), 2);
    let flag = AtomicBool::new(true);
    let cut = ComponentwiseMetropolis::default().interrupt(&flag).run(&target).expect("runs");
    assert!(cut.chains.iter().all(|c| c.stopped.as_deref() == Some("interrupted")));
}
