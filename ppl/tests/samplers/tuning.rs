//! Step size, mass matrix and proposal that the warmup adapts.

use ppl::{
    Chain, Chains, DrawStats, InverseMassMatrix, LogDensity, MapKind, MapSwitch, Metropolis, Nuts,
    RunError,
};

use crate::targets::Gaussian;

fn variances(covariance: &InverseMassMatrix) -> &[f64] {
    match covariance {
        InverseMassMatrix::Diagonal(variances) => variances,
        other => panic!("not diagonal: {other:?}"),
    }
}

fn acceptance(stats: &[DrawStats]) -> f64 {
    stats.iter().map(|s| s.acceptance).sum::<f64>() / stats.len() as f64
}

/// The chains of runs with four seeds; an assertion about the adaptation must hold for each run.
fn each_seed(run: impl Fn(u64) -> Result<Chains, RunError>) -> Vec<Chain> {
    (1..=4).flat_map(|seed| run(seed).expect("runs").chains).collect()
}

/// For independent normals, draws and scores determine the scales up to rounding.
#[test]
fn the_default_map_is_exact_for_independent_normals() {
    let target = Gaussian::autoregressive(5, 0.0, 1e-3, 1e3);
    let nuts = Nuts::default().warmup(200).draws(10);
    for chain in each_seed(|seed| nuts.clone().seed(seed).run(&target)) {
        for (i, variance) in variances(&chain.warmup.covariance).iter().enumerate() {
            approx::assert_relative_eq!(*variance, target.covariance[(i, i)], max_relative = 1e-9);
        }
    }
}

/// Stan's variances are estimated from the 500 draws of the last window; the test allows four relative
/// errors √(2/250), for draws that are worth half as many independent draws.
#[test]
fn the_stan_map_is_the_sample_variance() {
    let target = Gaussian::autoregressive(5, 0.0, 0.1, 10.0);
    let nuts = Nuts::stan_compatible().draws(10);
    for chain in each_seed(|seed| nuts.clone().seed(seed).run(&target)) {
        assert_eq!(chain.warmup.windows, [99, 149, 249, 449, 949]);
        for (i, variance) in variances(&chain.warmup.covariance).iter().enumerate() {
            let ratio = variance / target.covariance[(i, i)];
            assert!((ratio - 1.0).abs() < 4.0 * (2.0 / 250.0_f64).sqrt(), "{i}: {ratio}");
        }
    }
}

/// Dual averaging brings the mean acceptance since its restart to the target, up to γ (μ − ln ε)/√t, which is below
/// 0.02 in the last window of either schedule. The final step size, the exponential of an average of ln ε, gives a
/// higher acceptance, because acceptance is a concave function of ln ε; the difference grows with the variation of ln
/// ε.
#[test]
fn the_step_hits_its_target() {
    let target = Gaussian::autoregressive(10, 0.5, 0.1, 10.0);
    for wanted in [0.7, 0.8, 0.9] {
        for nuts in [Nuts::default(), Nuts::stan_compatible()] {
            let nuts = nuts.target_accept(wanted).chains(8).draws(300);
            for chain in each_seed(|seed| nuts.clone().seed(seed).run(&target)) {
                let [.., before, last] = chain.warmup.windows[..] else { panic!("two windows") };
                let steered = acceptance(&chain.warmup.stats[before + 1..=last]);
                assert!((steered - wanted).abs() < 0.02, "{steered}, not {wanted}");
                let frozen = acceptance(&chain.stats);
                assert!(frozen > wanted - 0.05 && frozen < 0.98, "{frozen}, not {wanted}");
            }
        }
    }
}

#[test]
fn nothing_is_adapted_after_the_warmup() {
    let target = Gaussian::autoregressive(3, 0.5, 0.1, 10.0);
    let chains = Nuts::default().seed(9).draws(50).run(&target).expect("runs");
    for chain in &chains.chains {
        assert_eq!(chain.warmup.stats.len(), 700);
        assert!(chain.warmup.stats.iter().all(|s| s.tuning));
        assert!(chain.stats.iter().all(|s| !s.tuning && s.step_size == chain.warmup.step_size));
    }
}

/// The proposal of Metropolis adapts to the covariance of the target and reaches the intended acceptance rate.
#[test]
fn metropolis_learns_its_proposal() {
    let target = Gaussian::autoregressive(4, 0.9, 0.1, 10.0);
    let metropolis = Metropolis::default().warmup(20_000).draws(5000);
    let chains = each_seed(|seed| metropolis.clone().seed(seed).run(&target));
    let mut means = Vec::new();
    for chain in &chains {
        let InverseMassMatrix::Dense(covariance) = &chain.warmup.covariance else {
            panic!("Metropolis has a full covariance")
        };
        for i in 0..4 {
            for j in 0..4 {
                let scale = (target.covariance[(i, i)] * target.covariance[(j, j)]).sqrt();
                let error = (covariance[4 * i + j] - target.covariance[(i, j)]) / scale;
                // the last window has about 8 000 draws and an effective sample size of several hundred
                assert!(error.abs() < 4.0 * (2.0 / 300.0_f64).sqrt(), "{i} {j}: {error}");
            }
        }
        means.push(acceptance(&chain.stats));
    }
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let wanted = chains[0].warmup.target_acceptance;
    approx::assert_relative_eq!(wanted, 0.234 + 0.206 / 4.0, max_relative = 1e-15);
    assert!((mean - wanted).abs() < 0.03, "{mean}, not {wanted}");
}

/// Divergences in the second half of the warmup raise the target acceptance of the default schedule: one divergence in
/// the last 15 % is enough, earlier it takes five.
#[test]
fn late_divergences_raise_the_target() {
    use crate::targets::half_normal;
    let start = vec![vec![1.0]; 4];
    let nuts = Nuts::default().init_points(start).draws(10);
    let chains = each_seed(|seed| nuts.clone().seed(seed).run(&half_normal()));
    for chain in &chains {
        let warmup = &chain.warmup;
        let late = warmup.stats[595..].iter().any(|s| s.divergent);
        match warmup.target_raised {
            Some(draw) => {
                assert!(draw >= 350 && warmup.stats[draw].divergent);
                let many = warmup.stats[350..=draw].iter().filter(|s| s.divergent).count() >= 5;
                let raised = if many { 0.95 } else { 0.9 };
                assert!(warmup.target_acceptance <= raised && warmup.target_acceptance > 0.8);
            }
            None => assert!(!late && warmup.target_acceptance == 0.8),
        }
    }
    assert!(chains.iter().any(|c| c.warmup.target_raised.is_some()));
}

/// The decisions of the warmup at every update of the mass matrix: the draw, the kind of the new matrix (`=` if the
/// previous matrix was kept), and whether the step size was restarted.
fn decisions(nuts: Nuts<'_>, target: &Gaussian) -> Vec<(usize, char, bool)> {
    let chains = nuts.chains(1).draws(1).seed(3).run(target).expect("runs").chains;
    let report = &chains[0].warmup;
    assert_eq!(report.windows, report.switches.iter().map(|s| s.draw).collect::<Vec<_>>());
    let letter = |switch: &MapSwitch| match switch.map {
        _ if switch.kept => '=',
        MapKind::Diagonal => 'd',
        MapKind::Dense => 'D',
        MapKind::LowRank { .. } => 'L',
    };
    report.switches.iter().map(|s| (s.draw, letter(s), s.restarted)).collect()
}

/// The schedule of the default preset on a correlated target, for short and long warmups: window ends, kinds of map,
/// restarts. A change of these values must be intended.
#[test]
fn golden_decisions_of_the_default_preset() {
    let target = Gaussian::autoregressive(5, 0.9, 0.1, 10.0);
    let of = |warmup| decisions(Nuts::default().warmup(warmup), &target);
    assert_eq!(of(19), []);
    assert_eq!(of(20), [(16, 'D', true)]);
    assert_eq!(of(100), [(9, 'D', true), (19, 'D', false), (29, 'D', false), (84, 'D', true)]);
    let early = [(9, 'D', true), (19, 'D', false), (29, 'D', false), (39, 'D', false)];
    assert_eq!(of(149), [&early[..], &[(125, 'D', true)]].concat());
    assert_eq!(of(150), [&early[..], &[(126, 'D', true)]].concat());
    let mut long: Vec<_> = (0..30).map(|k| (10 * k + 9, 'D', k == 0)).collect();
    long.extend([(379, '=', false), (499, '=', false), (849, 'D', true)]);
    assert_eq!(of(1000), long);
}

#[test]
fn golden_decisions_of_the_stan_preset() {
    let target = Gaussian::autoregressive(5, 0.9, 0.1, 10.0);
    let of = |warmup| decisions(Nuts::stan_compatible().warmup(warmup), &target);
    let all = |ends: &[usize]| ends.iter().map(|&end| (end, 'd', true)).collect::<Vec<_>>();
    assert_eq!(of(19), []);
    assert_eq!(of(20), all(&[17]));
    assert_eq!(of(100), all(&[89]));
    assert_eq!(of(149), all(&[134]));
    assert_eq!(of(150), all(&[99]));
    assert_eq!(of(1000), all(&[99, 149, 249, 449, 949]));
}

/// With 80 coordinates the map has a low rank, and the report compares the divergence of this map with the divergence
/// of a diagonal map.
#[test]
fn many_coordinates_get_a_low_rank_map() {
    let target = Gaussian::equicorrelated(80, 0.9, 0.1, 10.0);
    let nuts = Nuts::default().chains(1).warmup(300).draws(200).seed(1);
    let chains = nuts.run(&target).expect("runs");
    let last = chains.chains[0].warmup.switches.last().expect("switches").clone();
    assert!(matches!(last.map, MapKind::LowRank { rank: 1.. }), "{last:?}");
    let [(MapKind::Diagonal, plain), (MapKind::LowRank { .. }, correlated)] = last.divergences[..]
    else {
        panic!("{last:?}")
    };
    assert!(10.0 * correlated < plain, "{last:?}");
    // a diagonal map leaves a condition number of 720
    let of = |nuts: Nuts<'static>| cost(&nuts.chains(2).draws(300), &target, 0);
    let (ours, stan) = (of(Nuts::default().warmup(300)), of(Nuts::stan_compatible()));
    assert!(4.0 * ours < stan, "{ours:.1} against {stan:.1}");
}

/// Gradient evaluations per effective draw, without the warmup (0) or with it (1); the mean over three seeds,
/// because the results of single seeds vary by a fifth.
fn cost(nuts: &Nuts<'_>, density: &impl LogDensity, with_warmup: usize) -> f64 {
    let of = |seed| {
        let chains = nuts.clone().seed(seed).run(density).expect("runs");
        crate::kinds::gradients_per_effective_draw(&chains)[with_warmup]
    };
    (1..=3).map(of).sum::<f64>() / 3.0
}

/// The requirement on the default preset relative to Stan's, with the warmup counted: at most a quarter of the gradient
/// evaluations per effective draw on a correlated target. The bench `warmup` has the whole table.
#[test]
fn correlations_cost_a_quarter_of_what_they_cost_stan() {
    let (strain, stress) = crate::kinds::hardening_data();
    let hardening = crate::kinds::hardening(&strain, &stress);
    let (ours, stan) =
        (cost(&Nuts::default(), &hardening, 1), cost(&Nuts::stan_compatible(), &hardening, 1));
    assert!(ours < 0.25 * stan, "{ours:.1} against {stan:.1}");
}

#[test]
fn without_correlations_nothing_is_lost() {
    let schools = crate::kinds::eight_schools(&crate::kinds::EFFECTS, &crate::kinds::ERRORS);
    let (ours, stan) =
        (cost(&Nuts::default(), &schools, 1), cost(&Nuts::stan_compatible(), &schools, 1));
    assert!(ours < 1.1 * stan, "{ours:.1} against {stan:.1}");
}
