//! Findings in words: made where they are due, and not where nothing is wrong.

use ppl::diagnostics::Identification;
use ppl::prelude::*;
use ppl::{FindingKind, Posterior, Summary};

mod models;

use models::*;

fn data(count: usize, centre: f64) -> Vec<f64> {
    (0..count).map(|i| centre + 1.4 * (i as f64 * 2.399).sin()).collect()
}

/// Any bound model.
trait Sampled {
    fn posterior(&self, seed: u64) -> Posterior;
}

impl<M: ppl::Model> Sampled for ppl::Bound<M> {
    fn posterior(&self, seed: u64) -> Posterior {
        Nuts::default().seed(seed).sample(self).expect("it samples")
    }
}

fn what(summary: &Summary, kind: FindingKind) -> String {
    summary.findings.iter().filter(|f| f.kind == kind).map(ToString::to_string).collect()
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
        assert_eq!(what(&summary, FindingKind::PriorDataConflict), "", "seed {seed}");
        assert_eq!(what(&summary, FindingKind::Modes), "", "seed {seed}");
    }
}

#[test]
fn conflicts_with_heavy_tails_are_told_from_what_they_allow() {
    for seed in 0..3 {
        let y = [6000.0, 5000.0, 5500.0, 5800.0, 6100.0, 5100.0, 5300.0, 5900.0];
        let summary = far_out(&y).posterior(seed).summary();
        let conflict = what(&summary, FindingKind::PriorDataConflict);
        assert!(conflict.contains("mu (central half"), "{summary}");

        let summary = local_scale(5.0).posterior(seed).summary();
        assert_eq!(what(&summary, FindingKind::PriorDataConflict), "", "{summary}");
        assert_eq!(what(&summary, FindingKind::Uninformed), "", "the data moved it far");
    }
}

#[test]
fn a_handful_of_draws_is_too_few() {
    let y = data(20, 1.0);
    let model = mean(&y);
    for (chains, draws) in [(1, 1), (1, 3), (4, 1), (4, 2), (4, 3)] {
        let sampler = Nuts::default().chains(chains).draws(draws).seed(1);
        let summary = sampler.sample(&model).expect("it samples").summary();
        let few = what(&summary, FindingKind::FewEffectiveDraws);
        assert!(few.contains("mu, sd"), "{chains} chains of {draws}: {summary}");
        assert!(!summary.to_string().contains("Nothing wrong"));
        assert!(chains * draws == 1 || !few.contains("still"), "{summary}");
    }
    let summary = model.posterior(1).summary();
    assert!(summary.row("still").is_some_and(|row| row.rhat.is_nan()));
    assert_eq!(summary.findings, []);
}

#[test]
fn combinations_that_the_data_do_not_split_are_named() {
    let y = data(30, 2.0);
    for seed in 0..5 {
        let found = |model: &dyn Sampled, names: &str| {
            let summary = model.posterior(seed).summary();
            let found = what(&summary, FindingKind::Combination);
            assert!(found.contains(names), "seed {seed}: {summary}");
            assert_eq!(what(&summary, FindingKind::Uninformed), "", "said once");
        };
        found(&sum(&y), "a and b (correlation -1.00)");
        found(&difference(&y), "a and b (correlation 1.00)");
        found(&product(&y), "a and b (correlation -1.00)");
        found(&free_logits(&[0, 1, 1, 0, 1, 1, 1, 0, 1]), "a[0] and a[1] (correlation 0.9");
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
            assert_eq!(what(&summary, FindingKind::Combination), "", "seed {seed}: {summary}");
        };
        silent(&regression(&x, &line));
        silent(&schools(&effects, &errors));
        silent(&groups(&grouped));
        silent(&weak_groups(&data(24, 3.0), 12));
        silent(&correlated(&pairs));
    }
}

/// Entries of a factor say little one by one; those of plates within plates do.
#[test]
fn entries_of_matrices_are_told_apart() {
    let pairs: Vec<[f64; 2]> =
        data(10, 0.0).chunks(2).map(|y| [y[0], 0.9 * y[0] + 0.5 * y[1]]).collect();
    let summary = correlated(&pairs).posterior(1).summary();
    for kind in [FindingKind::Uninformed, FindingKind::PriorDataConflict] {
        assert!(!what(&summary, kind).contains("factor["), "{summary}");
    }
    let summary = table(&["a", "b"], &["x", "y"], &data(6, 0.0)).posterior(1).summary();
    let said = what(&summary, FindingKind::Uninformed);
    assert!(said.contains("cell[a,y]") && !said.contains("cell[b,x]"), "{summary}");
}

#[test]
fn one_sided_bounds_that_cut_are_found() {
    for seed in 0..3 {
        let boundary = |model: &dyn Sampled| {
            let summary = model.posterior(seed).summary();
            what(&summary, FindingKind::Boundary)
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
        assert_eq!(what(&summary, FindingKind::Boundary), "", "{summary}");
    }
}

#[test]
fn overflowing_priors_have_findings_in_plain_numbers() {
    for seed in 0..5 {
        let summary = overflowing(&[1.0, 2.0, 3.0, 4.0]).posterior(seed).summary();
        assert!(what(&summary, FindingKind::Divergences).contains("central half"), "{summary}");
        for finding in &summary.findings {
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
        let modes = what(&summary, FindingKind::Modes);
        assert!(modes.contains("mu[0] has 2") && modes.contains("mu[1] has 2"), "{summary}");
        assert_eq!(what(&summary, FindingKind::Uninformed), "", "seed {seed}");
    }
}

/// A visit to the tail that lasts, because the chain sticks there, is no mode: one in seven of these
/// runs has such a visit.
#[test]
fn visits_to_a_tail_are_no_modes() {
    for seed in 0..40 {
        let sampler = Nuts::default().seed(seed).warmup(200).draws(200);
        let summary = sampler.sample(&tail()).expect("it samples").summary();
        assert_eq!(what(&summary, FindingKind::Modes), "", "seed {seed}");
    }
}

#[test]
fn without_data_there_is_nothing_to_learn() {
    let summary = no_data().posterior(1).summary();
    assert!(summary.row("p").is_some_and(|row| row.contraction.is_some()));
    for kind in [FindingKind::Uninformed, FindingKind::Boundary, FindingKind::PriorDataConflict] {
        assert_eq!(what(&summary, kind), "");
    }
}

#[test]
fn divergences_at_rejected_points_are_the_rejections() {
    let summary = rejecting(1.0).posterior(1).summary();
    let found = what(&summary, FindingKind::Divergences);
    assert!(
        found.contains("ended at a point that a statement rejects, by their medians at x"),
        "{found}"
    );
    assert!(!found.contains("target acceptance"), "{found}");
    assert!(what(&summary, FindingKind::Rejections).contains("reject!"), "{summary}");
}
