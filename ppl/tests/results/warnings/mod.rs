//! Warnings of the summary: each warning is given for the models that need it, and no warning for a
//! sound model.

use ppl::diagnostics::Identification;
use ppl::prelude::*;
use ppl::{Posterior, Summary, WarningKind};

mod models;

use models::*;

fn data(count: usize, centre: f64) -> Vec<f64> {
    (0..count).map(|i| centre + 1.4 * (i as f64 * 2.399).sin()).collect()
}

/// A bound model that can be sampled with a seed.
trait Sampled {
    fn posterior(&self, seed: u64) -> Posterior;
}

impl<M: ppl::Model> Sampled for ppl::Bound<M> {
    fn posterior(&self, seed: u64) -> Posterior {
        Nuts::default().seed(seed).sample(self).expect("it samples")
    }
}

fn what(summary: &Summary, kind: WarningKind) -> String {
    summary.warnings.iter().filter(|f| f.kind == kind).map(ToString::to_string).collect()
}

#[test]
fn heavy_tails_that_no_datum_touches_are_uninformed() {
    for seed in 0..8 {
        let posterior = untouched(&data(30, 2.0)).posterior(seed);
        for row in &posterior.identifiability()[1..] {
            assert_ne!(row.label(), Identification::Identified, "seed {seed}: {row}");
            assert!(!row.conflict(), "seed {seed}: {row}");
        }
        let summary = posterior.summary();
        assert_eq!(what(&summary, WarningKind::PriorDataConflict), "", "seed {seed}");
        assert_eq!(what(&summary, WarningKind::Modes), "", "seed {seed}");
    }
}

#[test]
fn conflicts_with_heavy_tails_are_told_from_what_they_allow() {
    for seed in 0..3 {
        let y = [6000.0, 5000.0, 5500.0, 5800.0, 6100.0, 5100.0, 5300.0, 5900.0];
        let summary = far_out(&y).posterior(seed).summary();
        let conflict = what(&summary, WarningKind::PriorDataConflict);
        assert!(conflict.contains("mu (central half"), "{summary}");

        let summary = local_scale(5.0).posterior(seed).summary();
        assert_eq!(what(&summary, WarningKind::PriorDataConflict), "", "{summary}");
        assert_eq!(what(&summary, WarningKind::Uninformed), "", "the data moved it far");
    }
}

#[test]
fn a_handful_of_draws_is_too_few() {
    let y = data(20, 1.0);
    let model = mean(&y);
    for (chains, draws) in [(1, 1), (1, 3), (4, 1), (4, 2), (4, 3)] {
        let sampler = Nuts::default().chains(chains).draws(draws).seed(1);
        let summary = sampler.sample(&model).expect("it samples").summary();
        let few = what(&summary, WarningKind::FewEffectiveDraws);
        assert!(few.contains("mu, sd"), "{chains} chains of {draws}: {summary}");
        assert!(!summary.to_string().contains("Nothing wrong"));
        assert!(chains * draws == 1 || !few.contains("still"), "{summary}");
    }
    let summary = model.posterior(1).summary();
    assert!(summary.row("still").is_some_and(|row| row.rhat.is_nan()));
    assert_eq!(summary.warnings, []);
}

#[test]
fn combinations_that_the_data_do_not_split_are_named() {
    let y = data(30, 2.0);
    for seed in 0..5 {
        let found = |model: &dyn Sampled, names: &str| {
            let summary = model.posterior(seed).summary();
            let found = what(&summary, WarningKind::Combination);
            assert!(found.contains(names), "seed {seed}: {summary}");
            assert_eq!(what(&summary, WarningKind::Uninformed), "", "said once");
        };
        found(&sum(&y), "a and b (correlation -1.00)");
        found(&difference(&y), "a and b (correlation 1.00)");
        found(&product(&y), "a and b (correlation -1.00)");
        found(&free_levels(&[0, 1, 1, 0, 1, 1, 1, 0, 1]), "a[0] and a[1] (correlation 0.9");
        found(&intercepts(&y), "a, b[0], b[1], b[2] (largest correlation -");
    }
}

#[test]
fn correlations_of_sound_models_are_no_finding() {
    let x: Vec<f64> = (0..30).map(|i| 20.0 + (i as f64 * 0.7).sin()).collect();
    let line: Vec<f64> = x.iter().zip(data(30, 0.0)).map(|(x, e)| x - 18.0 + e).collect();
    let effects = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
    let errors = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];
    let grouped: Vec<f64> =
        data(80, 3.0).iter().enumerate().map(|(i, y)| y + 1.5 * (i as f64 % 4.0)).collect();
    let pairs: Vec<[f64; 2]> = data(40, 0.0).chunks(2).map(|y| [y[0], y[0] + 0.4 * y[1]]).collect();
    for seed in 0..3 {
        let silent = |model: &dyn Sampled| {
            let summary = model.posterior(seed).summary();
            assert_eq!(what(&summary, WarningKind::Combination), "", "seed {seed}: {summary}");
        };
        silent(&regression(&x, &line));
        silent(&schools(&effects, &errors));
        silent(&groups(&grouped));
        silent(&weak_groups(&data(24, 3.0), 12));
        silent(&correlated(&pairs));
    }
}

/// The summary warns about single entries of nested plates, and not about entries of a Cholesky factor.
#[test]
fn entries_of_matrices_are_told_apart() {
    let pairs: Vec<[f64; 2]> =
        data(10, 0.0).chunks(2).map(|y| [y[0], 0.9 * y[0] + 0.5 * y[1]]).collect();
    let mut posterior = correlated(&pairs).posterior(1);
    for dimension in [0, 1] {
        posterior.label("factor", dimension, &["force", "slope"]).expect("two by two");
    }
    let summary = posterior.summary();
    let shown: Vec<&str> = summary.rows.iter().map(|row| row.name.as_str()).collect();
    let moving = ["mu[0]", "mu[1]", "sd[0]", "sd[1]", "factor[slope,force]", "factor[slope,slope]"];
    assert_eq!(shown, moving, "the other entries of the factor are 1 and 0 by construction");
    for kind in [WarningKind::Uninformed, WarningKind::PriorDataConflict] {
        assert!(!what(&summary, kind).contains("factor["), "{summary}");
    }
    let summary = table(&["a", "b"], &["x", "y"], &data(6, 0.0)).posterior(1).summary();
    let said = what(&summary, WarningKind::Uninformed);
    assert!(said.contains("cell[a,y]") && !said.contains("cell[b,x]"), "{summary}");
}

#[test]
fn one_sided_bounds_that_cut_are_found() {
    for seed in 0..3 {
        let boundary = |model: &dyn Sampled| {
            let summary = model.posterior(seed).summary();
            what(&summary, WarningKind::Boundary)
        };
        assert!(boundary(&above(&data(30, -0.3))).contains("mu ("));
        assert!(boundary(&below(&data(30, 5.0))).contains("mu ("));
        assert_eq!(boundary(&above(&data(30, 3.0))), "", "far from the bound");
        assert_eq!(boundary(&above(&[])), "", "the prior's own shape");
        assert_eq!(boundary(&scales(-0.1, -0.1)), "");
        assert_eq!(boundary(&own_bounds(&[1.0, 12.0, 19.0])), "");
    }
}

#[test]
fn priors_with_mass_at_their_ends_cut_nothing_off() {
    for (seed, k) in [(1, 0), (2, 1), (11, 1)] {
        let summary = shares(k).posterior(seed).summary();
        assert_eq!(what(&summary, WarningKind::Boundary), "", "{summary}");
    }
}

#[test]
fn overflowing_priors_have_warnings_in_plain_numbers() {
    for seed in 0..5 {
        let summary = overflowing(&[1.0, 2.0, 3.0, 4.0]).posterior(seed).summary();
        assert!(what(&summary, WarningKind::Divergences).contains("central half"), "{summary}");
        for finding in &summary.warnings {
            assert!(!finding.what.contains("NaN"), "seed {seed}: {finding}");
            let longest = finding.what.split(' ').map(str::len).max();
            assert!(longest < Some(20), "seed {seed}: {finding}");
        }
    }
}

#[test]
fn what_exchanges_its_labels_was_informed() {
    let y: Vec<f64> = (0..60).map(|i| if i % 2 == 0 { -2.4 } else { 2.4 }).collect();
    for seed in [1, 2, 3] {
        let summary = labels(&y).posterior(seed).summary();
        let modes = what(&summary, WarningKind::Modes);
        assert!(modes.contains("mu[0] has 2") && modes.contains("mu[1] has 2"), "{summary}");
        assert_eq!(what(&summary, WarningKind::Uninformed), "", "seed {seed}");
    }
}

/// A long visit to the tail, where the chain sticks, is no mode; one in seven of these runs has such a visit.
#[test]
fn visits_to_a_tail_are_no_modes() {
    for seed in 0..40 {
        let sampler = Nuts::default().seed(seed).warmup(200).draws(200);
        let summary = sampler.sample(&tail()).expect("it samples").summary();
        assert_eq!(what(&summary, WarningKind::Modes), "", "seed {seed}");
    }
}

#[test]
fn without_data_there_is_nothing_to_learn() {
    let summary = no_data().posterior(1).summary();
    assert!(summary.row("p").is_some_and(|row| row.contraction.is_some()));
    for kind in [WarningKind::Uninformed, WarningKind::Boundary, WarningKind::PriorDataConflict] {
        assert_eq!(what(&summary, kind), "");
    }
}

#[test]
fn divergences_at_rejected_points_are_the_rejections() {
    let summary = rejecting(1.0).posterior(1).summary();
    let found = what(&summary, WarningKind::Divergences);
    assert!(
        found.contains("ended at a point that a statement rejects; median of these points: x"),
        "{found}"
    );
    assert!(!found.contains("target acceptance"), "{found}");
    assert!(what(&summary, WarningKind::Rejections).contains("reject!"), "{summary}");
}

/// A boundary warning is given only for a bound that the prior chose, not for the lower bound 0 of a scale.
#[test]
fn a_uniform_prior_of_a_scale_ends_at_zero() {
    let found = |y, other| {
        let summary = flat_scale(y, other).posterior(1).summary();
        what(&summary, WarningKind::Boundary)
    };
    assert_eq!(found(-0.1, 0.0), "", "a scale near its natural end");
    let upper = found(101.0, 0.0);
    assert!(upper.contains("sigma (") && upper.contains("% at its upper end 100.0"), "{upper}");
    let both = found(101.0, 3.0);
    assert!(both.contains("% at its upper end 2.000"), "{both}");
}

/// If half of the prior lies outside the domain of the likelihood, the summary says so, even where no transition after
/// the warmup was rejected.
#[test]
fn a_scale_that_may_be_negative_is_told() {
    for seed in 0..4 {
        let summary = free_scale(&data(30, 1.0)).posterior(seed).summary();
        let prior = what(&summary, WarningKind::PriorOutsideDomain);
        assert!(prior.contains("% were rejected at `y ~ Normal(mu, s)`"), "{summary}");
        assert!(!summary.to_string().contains("Nothing wrong"), "{summary}");
        let counts = free_scale(&data(30, 1.0)).posterior(seed).rejections();
        let warmup: u64 = counts.values().map(|(warmup, _)| warmup).sum();
        let said = what(&summary, WarningKind::Rejections);
        assert!(warmup < 40 || said.contains(&format!("and {warmup} in the warmup")), "{summary}");
    }
    let summary = mean(&data(30, 1.0)).posterior(1).summary();
    assert_eq!(what(&summary, WarningKind::PriorOutsideDomain), "");
}

#[test]
fn empty_data_are_told() {
    let summary = mean(&[]).posterior(1).summary();
    assert!(what(&summary, WarningKind::NoData).contains("empty slice"), "{summary}");
    let summary = mean(&data(5, 1.0)).posterior(1).summary();
    assert_eq!(what(&summary, WarningKind::NoData), "");

    let (y, x) = (data(3, 1.0), [1.0, 2.0]);
    let none = |y: &[f64], x: &[f64], groups: &[&[f64]]| {
        what(&kinds(y, x, groups).posterior(1).summary(), WarningKind::NoData)
    };
    assert_eq!(none(&y, &x, &[&[], &y]), "", "one group of several may be empty");
    for (found, name) in [
        (none(&[], &x, &[&y]), "`y`"),
        (none(&y, &[], &[&y]), "`fx`"),
        (none(&y, &x, &[&[], &[]]), "`v`"),
        (none(&[], &x, &[&[], &[]]), "`y`, `v`"),
    ] {
        assert!(found.contains(&format!("Nothing was observed: {name}.")), "{found}, not {name}");
    }
}

fn from(starts: &[&[f64]], warmup: usize, model: &ppl::Bound<impl ppl::Model>) -> Posterior {
    let starts = starts.iter().map(|start| start.to_vec()).collect();
    let sampler = Nuts::default().seed(1).warmup(warmup).draws(300);
    sampler.init_points(starts).sample(model).expect("it samples")
}

/// Asserts that the first warning names the stuck chain and that no warning computed from all draws follows.
fn says_only_that_it_is_stuck(summary: &Summary, chain: &str) {
    assert_eq!(summary.warnings[0].kind, WarningKind::StuckChain, "{summary}");
    let stuck = summary.warnings[0].to_string();
    assert!(stuck.contains(chain) && stuck.contains("init_points"), "{summary}");
    for kind in [
        WarningKind::Disagreement,
        WarningKind::Modes,
        WarningKind::FewEffectiveDraws,
        WarningKind::Uninformed,
        WarningKind::Combination,
        WarningKind::Boundary,
        WarningKind::PriorDataConflict,
    ] {
        assert_eq!(what(summary, kind), "", "{summary}");
    }
}

#[test]
fn chains_far_below_the_others_are_named() {
    let near: &[f64] = &[0.0, 0.0];
    // x = 50 on the unconstrained scale: ln((50 + 20)/(60 − 50)) = ln 7
    let far: &[f64] = &[7f64.ln(), 0.0];
    let posterior = from(&[near, far, near, near], 300, &heaps(-200.0));
    says_only_that_it_is_stuck(&posterior.summary(), "chain 1 near -2");

    let x: Vec<f64> = (0..40).map(f64::from).collect();
    let k: Vec<u64> = (0..40).map(|t| 26 + 6 * t).collect();
    let near: &[f64] = &[3.5, 0.05];
    let posterior = from(&[near, near, near, &[-20.0, 0.5]], 0, &counts(&k, &x));
    says_only_that_it_is_stuck(&posterior.summary(), "chain 3");
}

#[test]
fn chains_that_do_not_move_are_named() {
    let y = data(30, 2.0);
    let model = mean(&y);
    let mut chains = Nuts::default().seed(1).draws(200).run(&model).expect("runs");
    let chain = &mut chains.chains[2];
    let start = chain.draws[..2].to_vec();
    chain.draws = start.repeat(200);
    let (first, acceptance) = (chain.stats[0].log_density, 0.0);
    for stats in &mut chain.stats {
        (stats.log_density, stats.acceptance) = (first, acceptance);
    }
    let posterior = Posterior::from_chains(&model, chains, 1).expect("its chains");
    let stuck = "chain 2 in 0 of 199 transitions (mean acceptance 0.00)";
    says_only_that_it_is_stuck(&posterior.summary(), stuck);
    assert_eq!(posterior.power_scaling().expect("it has data").warnings(), []);
}

/// Several modes, slow mixing and modes of different widths do not make a chain count as stuck.
#[test]
fn no_chain_is_called_stuck_for_nothing() {
    let effects = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
    let errors = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];
    let y: Vec<f64> = (0..60).map(|i| if i % 2 == 0 { -2.4 } else { 2.4 }).collect();
    for seed in 0..8 {
        // in the neck of a funnel, and where a prior overflows, a chain may truly stay at one point
        let near = |name: &str, model: &dyn Sampled| {
            let summary = model.posterior(seed).summary();
            let stuck = what(&summary, WarningKind::StuckChain);
            assert!(!stuck.contains("far below"), "{name}, {seed}: {summary}");
            stuck
        };
        near("centred", &centred(&effects, &errors));
        near("funnel", &funnel());
        near("tail", &tail());
        near("wide and narrow", &wide_and_narrow());
        near("overflowing", &overflowing(&[1.0, 2.0, 3.0, 4.0]));
        assert_eq!(near("labels", &labels(&y)), "");
        assert_eq!(near("untouched", &untouched(&data(30, 2.0))), "");
        assert_eq!(near("schools", &schools(&effects, &errors)), "");
    }
    let (narrow, wide) = ([0.0; 12], [100.0; 12]);
    let summary = from(&[&narrow, &wide, &wide, &narrow], 300, &wide_and_narrow()).summary();
    assert_eq!(what(&summary, WarningKind::StuckChain), "", "{summary}");
    assert_ne!(what(&summary, WarningKind::Modes), "", "{summary}");
    let (low, high): (&[f64], &[f64]) = (&[0.0, 0.0], &[7f64.ln(), 0.0]);
    let summary = from(&[low, high, high, low], 300, &heaps(-8.0)).summary();
    assert_eq!(what(&summary, WarningKind::StuckChain), "", "{summary}");
}
