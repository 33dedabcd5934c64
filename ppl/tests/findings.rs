//! Findings in words: made where they are due, and not where nothing is wrong.

use ppl::diagnostics::Identification;
use ppl::prelude::*;
use ppl::{FindingKind, Posterior, Summary};

ppl::model! {
    /// Four unknowns with heavy tails that no datum touches.
    fn untouched(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let half ~ HalfCauchy(1.0);
        let whole ~ Cauchy(0.0, 1.0);
        let inverse ~ InverseGamma(1.0, 1.0);
        let student ~ StudentT(2.5, 0.0, 1.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    /// The data lie where a Cauchy prior has less than a thousandth, and say little.
    fn far_out(y: &[f64]) {
        let mu ~ Cauchy(0.0, 1.0);
        for y in y {
            y ~ Normal(mu, 800.0);
        }
    }

    /// The scale of one coefficient of a horseshoe: its prior has a hundredth out there.
    fn local_scale(coefficient: f64) {
        let lambda ~ HalfCauchy(1.0);
        coefficient ~ Normal(0.0, 0.1 * lambda);
    }

    fn mean(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let sd ~ HalfNormal(5.0);
        #[track] let still = 0.1;
        for y in y {
            y ~ Normal(mu, sd);
        }
    }

    fn sum(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        for y in y {
            y ~ Normal(a + b, 1.0);
        }
    }

    fn difference(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        for y in y {
            y ~ Normal(a - b, 1.0);
        }
    }

    fn product(y: &[f64]) {
        let a ~ LogNormal(0.0, 1.0);
        let b ~ LogNormal(0.0, 1.0);
        for y in y {
            y ~ Normal(a * b, 0.1);
        }
    }

    fn free_logits(k: &[u64]) {
        let a ~ Normal(0.0, 5.0).array::<2>();
        for k in k {
            k ~ CategoricalLogit(a);
        }
    }

    fn intercepts(y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0).array::<3>();
        for i in 0..y.len() {
            y[i] ~ Normal(a + b[i % 3], 1.0);
        }
    }

    /// Slopes that go against the intercept.
    fn regression(x: &[f64], y: &[f64]) {
        let a ~ Normal(0.0, 10.0);
        let b ~ Normal(0.0, 10.0);
        let sd ~ HalfNormal(5.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(a + b * x, sd);
        }
    }

    fn schools(y: &[f64], sd: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for i in 0..8 {
            y[i] ~ Normal(mu + tau * z[i], sd[i]);
        }
    }

    /// Well measured groups in standardised form: their common part is taken up by the mean.
    fn groups(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(2.0);
        let z ~ Normal(0.0, 1.0).array::<4>();
        for i in 0..y.len() {
            y[i] ~ Normal(mu + tau * z[i % 4], 1.0);
        }
    }

    /// Groups with little data, tied together by their prior.
    fn weak_groups(y: &[f64], count: usize) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(2.0);
        let m ~ Normal(mu, tau).iid(count);
        for i in 0..y.len() {
            y[i] ~ Normal(m[i % count], 2.0);
        }
    }

    fn correlated(y: &[[f64; 2]]) {
        let mu ~ Normal(0.0, 5.0).array::<2>();
        let sd ~ HalfNormal(3.0).array::<2>();
        let factor ~ LkjCholesky::<2>(2.0);
        for y in y {
            y ~ MvNormalCholesky(mu, factor.scale_rows(sd));
        }
    }

    /// One cell of a table is measured.
    fn table(rows: &[&str], columns: &[&str], y: &[f64]) {
        let mut last = Real::from(0.0);
        #[dims(row = rows)]
        for row in rows.iter() {
            #[dims(column = columns)]
            for column in columns.iter() {
                let cell ~ Normal(0.0, 5.0);
                if (*row, *column) == ("b", "x") {
                    last = cell;
                }
            }
        }
        for y in y {
            y ~ Normal(last, 1.0);
        }
    }

    fn above(y: &[f64]) {
        let mu ~ Normal(0.0, 5.0).truncate(1.0..);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    fn below(y: &[f64]) {
        let mu ~ Normal(0.0, 5.0).truncate(..2.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    /// Scales that the data hold near zero, where every scale ends.
    fn scales(y: f64, other: f64) {
        let a ~ HalfNormal(5.0);
        let b ~ Normal(0.0, 5.0).truncate(0.0..);
        y ~ Normal(a, 0.3);
        other ~ Normal(b, 0.3);
    }

    /// Each unknown has bounds of its own; the draws of all but the last lie beyond its bounds.
    fn own_bounds(y: &[f64]) {
        for (i, y) in y.iter().enumerate() {
            let centre = 10.0 * i as f64;
            let x ~ Uniform(centre - 5.0, centre + 5.0);
            y ~ Normal(x, 0.1);
        }
    }

    /// Priors with mass at their ends, for shares that one datum touches or none.
    fn shares(k: u64) {
        let rho ~ Beta(0.5, 0.5);
        let stick ~ Beta(1.0, 6.0).array::<3>();
        let small ~ Normal(0.0, 0.1).truncate(0.0..10.0);
        k ~ Binomial(1u64, rho);
    }

    /// The prior of `a` overflows.
    fn overflowing(y: &[f64]) {
        let sd ~ HalfCauchy(5.0);
        let a ~ LogNormal(0.0, sd).array::<4>();
        let m ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(m, 0.1);
        }
    }

    /// Two components that may exchange their labels.
    fn labels(y: &[f64]) {
        let mu ~ Normal(0.0, 2.0).array::<2>();
        for y in y {
            y ~ Mixture([0.5, 0.5], [Normal(mu[0], 1.0), Normal(mu[1], 1.0)]);
        }
    }

    /// One mode with a tail that narrows, in which chains stick.
    fn tail() {
        let x ~ HalfCauchy(1.0);
        let z ~ Normal(0.0, 1.0);
        let product = z * x / (1.0 + 1e-4 * x.square()).sqrt();
        factor(-0.5 * ((product - 3.0) / 0.3).square());
    }

    fn no_data() {
        let p ~ Beta(0.3, 0.4);
        let x ~ Normal(0.0, 1.0);
    }

    fn rejecting(y: f64) {
        let x ~ Normal(0.0, 1.0);
        if x > 1.0 {
            reject!("x must not be above 1, it is {x:?}");
        }
        y ~ Normal(x, 1.0);
    }
}

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
