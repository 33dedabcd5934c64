//! From chains to a posterior, its summary, its warnings and its files.

use std::fs;

use ppl::prelude::*;
use ppl::{Group, Posterior, PosteriorError, Role, StopReason, Values, WarningKind, check};

ppl::model! {
    /// A mean with a posterior in closed form, a parameter `idle` that the data do not inform, and a parameter `edge`
    /// that the data pull beyond its upper bound.
    fn means(y: &[f64], beyond: f64, other: f64) {
        let mu ~ Normal(0.0, 10.0).array::<2>();
        let idle ~ Uniform(-1.0, 1.0);
        let edge ~ Uniform(0.0, 1.0);
        #[track] let twice = [2.0 * mu[0], 2.0 * mu[1]];
        #[track] let still = idle;
        for y in y {
            y ~ Normal(mu[0], 1.0);
        }
        beyond ~ Normal(edge, 0.02);
        other ~ Normal(mu[1], 0.5);
        #[predict] let next ~ Normal(mu[0], 1.0);
    }
}

ppl::model! {
    /// Two modes, at ±10.
    fn two_modes(square: f64) {
        let x ~ Normal(0.0, 10.0);
        square ~ Normal(x * x, 1.0);
    }
}

ppl::model! {
    /// Neal's funnel, whose neck makes trajectories diverge.
    fn funnel() {
        let v ~ Normal(0.0, 3.0);
        let x ~ Normal(0.0, (0.5 * v).exp()).array::<9>();
    }
}

ppl::model! {
    /// A factor that is not defined for x > 1, and a prediction that is not defined for x < −1.
    fn edgy() {
        let x ~ Normal(0.0, 1.0);
        factor(0.0 * (1.0 - x).ln());
        #[predict] let early ~ Normal(x, 1.0);
        #[predict] let late ~ Normal(0.0, x + 1.0);
    }
}

ppl::model! {
    fn noisy(y: &[f64], sd: f64) {
        let mu ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(mu, sd);
        }
    }
}

const Y: [f64; 5] = [1.0, 2.0, 3.0, 4.0, 5.0];

fn posterior() -> Posterior {
    let sampler = Nuts::default().chains(4).warmup(500).draws(2000).seed(7);
    sampler.sample(&means(&Y, 1.5, 3.0)).expect("runs")
}

#[test]
fn names_shapes_and_moments_of_a_conjugate_model() {
    let posterior = posterior();
    let names: Vec<&str> = posterior.posterior.variables.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["mu", "idle", "edge", "twice", "still"]);
    assert_eq!(posterior.values("mu").map(|v| v.shape.clone()), Some(vec![2]));
    assert_eq!(posterior.predictive.get("y").map(|v| v.shape.clone()), Some(vec![5]));
    assert_eq!(posterior.log_likelihood.get("y").map(|v| v.shape.clone()), Some(vec![5]));
    assert_eq!(posterior.log_likelihood.get("other").map(|v| v.shape.clone()), Some(vec![]));
    assert_eq!(posterior.observed.get("y").map(|v| v.data.clone()), Some(Y.to_vec()));
    assert_eq!(posterior.layout.with_role(Role::Predicted).count(), 1);

    // precision n/σ² + 1/τ² = 5.01, mean Σy / 5.01
    let sd = 5.01_f64.powf(-0.5);
    check::mean(&posterior, "mu[0]", 15.0 / 5.01).within_mcse(4.0);
    check::sd(&posterior, "mu[0]", sd).within_mcse(4.0);
    check::quantile(&posterior, "mu[0]", 0.95, 15.0 / 5.01 + 1.6448536 * sd).within_mcse(4.0);
    check::mean(&posterior, "twice[0]", 30.0 / 5.01).within_mcse(4.0);
    check::mean(&posterior, "next", 15.0 / 5.01).within_mcse(4.0);
    check::sd(&posterior, "next", (1.0 + sd * sd).sqrt()).within_mcse(4.0);

    // computes the log-likelihood of every draw a second time
    let mu = posterior.trace("mu[0]").expect("a parameter").concat();
    let stored = posterior.log_likelihood.trace("y[3]").expect("an observation").concat();
    for (mu, stored) in mu.iter().zip(stored) {
        let exact = -0.5 * (4.0 - mu).powi(2) - 0.5 * (2.0 * std::f64::consts::PI).ln();
        assert!((stored - exact).abs() < 1e-12);
    }
    let loo = posterior.loo().expect("finite likelihoods");
    assert_eq!(loo.points.len(), 7);
}

ppl::model! {
    /// Normal observations, and counts whose log-likelihood is added by `factor`.
    fn halves(y: &[f64], k: &[u64]) {
        let mu ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(mu, 1.0);
        }
        for k in k {
            factor(PoissonLog(mu).ln_density(k));
        }
    }
}

#[test]
fn cross_validation_says_what_it_leaves_in() {
    let words = |k: &[u64]| {
        let model = halves(&[0.3, -0.4, 0.9, 0.1], k);
        let posterior = Nuts::default().draws(200).seed(1).sample(&model).expect("it samples");
        posterior.loo().expect("finite likelihoods").to_string()
    };
    assert!(words(&[1, 0, 2]).contains("`factor`"));
    assert!(!words(&[]).contains("`factor`"));
}

#[test]
fn the_summary_says_what_the_data_did_not_inform() {
    let summary = posterior().summary();
    let contraction = |name: &str| summary.row(name).and_then(|r| r.contraction);
    assert!(contraction("mu[0]").expect("a parameter") > 0.99);
    assert!(contraction("idle").expect("a parameter").abs() < 0.1);
    assert_eq!(contraction("twice[0]"), None, "tracked quantities have no prior of their own");

    let find = |kind| summary.warnings.iter().find(|f| f.kind == kind);
    let uninformed = find(WarningKind::Uninformed).expect("idle is not informed");
    assert!(uninformed.what.contains("idle") && !uninformed.what.contains("mu"), "{uninformed}");
    let boundary = find(WarningKind::Boundary).expect("edge is cut");
    assert!(boundary.what.contains("edge") && !boundary.what.contains("idle"), "{boundary}");
    assert_eq!(find(WarningKind::Disagreement), None);
    assert_eq!(find(WarningKind::FewEffectiveDraws), None);

    let printed = summary.to_string();
    for part in ["mean", "ess_tail", "mu[1]", "4 chains of 2000 draws", "idle"] {
        assert!(printed.contains(part), "{printed}");
    }
}

ppl::model! {
    /// Observations about ten prior standard deviations from the prior of `rate`, and a parameter `known` that they
    /// hardly inform.
    fn surprise(y: &[f64]) {
        let rate ~ Exponential(1.0);
        let known ~ Normal(0.0, 1.0);
        for y in y {
            y ~ Normal(rate, 8.0);
            let other = y;
            other ~ Normal(rate + known, 8.0);
        }
    }
}

#[test]
fn a_posterior_wider_than_its_prior_is_no_lack_of_data() {
    let model = surprise(&[60.0, 50.0, 55.0, 58.0]);
    let posterior = Nuts::default().warmup(300).draws(300).seed(3).sample(&model);
    let warnings = posterior.expect("it samples").summary().warnings;
    let find = |kind| warnings.iter().find(|f| f.kind == kind).map(|f| f.what.clone());
    let conflict = find(WarningKind::PriorDataConflict).expect("the prior is far off");
    assert!(conflict.contains("rate") && !conflict.contains("known"), "{conflict}");
    let uninformed = find(WarningKind::Uninformed).expect("`known` is hardly informed");
    assert!(uninformed.contains("known") && !uninformed.contains("rate"), "{uninformed}");
}

#[test]
fn the_same_seed_gives_the_same_predictions() {
    let (a, b) = (posterior(), posterior());
    assert_eq!(a.predictive, b.predictive);
    assert_eq!(a.prior, b.prior);
    assert_eq!(a.posterior, b.posterior);
}

#[test]
fn a_stopped_chain_cuts_all_and_is_reported() {
    let model = means(&Y, 1.5, 3.0);
    let run = Nuts::default().chains(2).warmup(200).draws(200).seed(1).run(&model).expect("runs");
    let mut cut = run.clone();
    cut.chains[1].stats.truncate(50);
    cut.chains[1].draws.truncate(50 * cut.dim);
    cut.chains[1].stopped = Some(StopReason::Interrupted);
    let posterior = Posterior::from_chains(&model, cut.clone(), 1).expect("50 draws are left");
    assert_eq!(posterior.posterior.draws, 50);
    let summary = posterior.summary();
    assert!(summary.warnings.iter().any(|f| f.kind == WarningKind::Stopped));
    assert!(summary.warnings.iter().any(|f| f.kind == WarningKind::FewEffectiveDraws));

    cut.chains[1].stats.clear();
    cut.chains[1].draws.clear();
    let error = Posterior::from_chains(&model, cut, 1).expect_err("no draw");
    assert!(matches!(error, PosteriorError::NoDraws { chain: 1, .. }), "{error}");

    let mut other = run;
    other.dim = 3;
    let error = Posterior::from_chains(&model, other, 1).expect_err("not its chains");
    assert!(error.to_string().contains("3 coordinates but the model has 4"), "{error}");
}

#[test]
fn chains_in_two_modes_are_found_out() {
    let model = two_modes(100.0);
    let starts = vec![vec![10.0], vec![-10.0], vec![10.0], vec![-10.0]];
    let run = Nuts::default().chains(4).warmup(300).draws(300).init_points(starts).run(&model);
    let posterior = Posterior::from_chains(&model, run.expect("runs"), 0).expect("its chains");
    let summary = posterior.summary();
    let found = summary.warnings.iter().find(|f| f.kind == WarningKind::Disagreement);
    assert!(found.is_some_and(|f| f.what.contains("x (")), "{summary}");
    let found = summary.warnings.iter().find(|f| f.kind == WarningKind::Modes);
    let found = found.expect("modes").to_string();
    for part in ["x has 2, near -10.", "(chains 1, 3) and ", "(chains 0, 2), with 0 changes"] {
        assert!(found.contains(part), "{found}");
    }
}

#[test]
fn divergences_are_located_in_the_neck_of_a_funnel() {
    let model = funnel();
    let run = Nuts::default().chains(4).warmup(300).draws(3000).seed(3).run(&model).expect("runs");
    let posterior = Posterior::from_chains(&model, run, 3).expect("its chains");
    assert!(!posterior.divergences.is_empty());
    let summary = posterior.summary();
    let found = summary.warnings.iter().find(|f| f.kind == WarningKind::Divergences);
    assert!(found.is_some_and(|f| f.what.contains("v ≈ ")), "{summary}");
    assert!(found.is_some_and(|f| f.advice.contains("to 0.95, then 0.99")), "{summary}");
    let v =
        posterior.divergences.iter().filter_map(|d| d.values.iter().find(|(name, _)| name == "v"));
    let v: Vec<f64> = v.map(|(_, value)| *value).collect();
    let mean = v.iter().sum::<f64>() / v.len() as f64;
    let everywhere = summary.row("v").expect("a parameter").mean;
    assert!(mean < everywhere - 0.5, "diverged at {mean}, drawn around {everywhere}");
}

#[test]
fn nobody_is_told_to_raise_the_target_acceptance_to_what_it_is() {
    let model = funnel();
    for (target, advice) in [(0.95, "acceptance to 0.99,"), (0.99, "reparametrise, or use")] {
        let mut seeds = (0..40).map(|seed| {
            let sampler = Nuts::default().chains(4).warmup(100).draws(1000).seed(seed);
            let run = sampler.target_accept(target).run(&model).expect("runs");
            Posterior::from_chains(&model, run, seed).expect("its chains")
        });
        let diverged = seeds.find(|posterior| posterior.chains.divergences() > 0);
        let summary = diverged.expect("a funnel has a neck").summary();
        let found = summary.warnings.iter().find(|f| f.kind == WarningKind::Divergences);
        assert!(found.is_some_and(|f| f.advice.contains(advice)), "{summary}");
    }
}

#[test]
fn rejected_points_and_predictions_are_counted_with_their_statement() {
    let posterior = Nuts::default().chains(4).seed(2).sample(&edgy()).expect("runs");
    let summary = posterior.summary();
    let find = |kind| summary.warnings.iter().find(|f| f.kind == kind);
    assert!(
        find(WarningKind::Rejections).is_some_and(|f| f.what.contains("`factor(")),
        "{summary}"
    );
    assert!(
        find(WarningKind::Unpredicted).is_some_and(|f| f.what.contains("`let late")),
        "{summary}"
    );

    let x = posterior.trace("x").expect("a parameter").concat();
    let early = posterior.trace("early").expect("a prediction").concat();
    let late = posterior.trace("late").expect("a prediction").concat();
    assert!(x.iter().chain(&early).all(|v| v.is_finite()), "what precedes is kept");
    assert!(x.iter().zip(&late).all(|(x, late)| late.is_nan() == (*x <= -1.0)));
    let missing = late.iter().filter(|v| v.is_nan()).count() as u64;
    assert_eq!(posterior.unpredicted.values().sum::<u64>(), missing);
}

#[test]
fn short_trees_are_reported() {
    let sampler = Nuts::default().chains(2).warmup(200).draws(200).max_depth(2);
    let posterior = sampler.sample(&funnel()).expect("runs");
    let summary = posterior.summary();
    assert!(summary.warnings.iter().any(|f| f.kind == WarningKind::TreeDepth), "{summary}");
}

#[test]
fn files_hold_the_draws() {
    let mut posterior = posterior();
    posterior.label("mu", 0, &["first", "second"]).expect("two labels for two");
    assert!(posterior.label("mu", 0, &["one label for two"]).is_err());
    let folder = tempfile::tempdir().expect("a folder");

    let csv = folder.path().join("draws.csv");
    posterior.write_csv(&csv).expect("written");
    let text = fs::read_to_string(&csv).expect("readable");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("chain,draw,mu[0],mu[1],idle,edge,twice[0],twice[1],still"));
    let row: Vec<f64> = lines
        .nth(2001)
        .expect("chain 1, draw 1")
        .split(',')
        .map(|cell| cell.parse().expect("a number"))
        .collect();
    assert_eq!(row[..2], [1.0, 1.0]);
    assert_eq!(row[2], posterior.trace("mu[0]").expect("a parameter")[1][1], "to the last bit");

    let table = folder.path().join("summary.csv");
    posterior.summary().write_csv(&table).expect("written");
    let text = fs::read_to_string(&table).expect("readable");
    assert!(text.starts_with(
        "parameter,mean,sd,q05,q50,q95,rhat,ess_bulk,ess_tail,contraction,mcse_mean\nmu[0],"
    ));

    let store = folder.path().join("posterior.zarr");
    posterior.write_zarr(&store).expect("written");
    posterior.write_zarr(&store).expect("an older store is replaced");
    let chunk = fs::read(store.join("posterior/mu/c/0/0/0")).expect("one chunk");
    assert_eq!(chunk.len(), 4 * 2000 * 2 * 8);
    let root: serde_json::Value =
        serde_json::from_slice(&fs::read(store.join("zarr.json")).expect("a root")).expect("JSON");
    let mu = &root["consolidated_metadata"]["metadata"]["posterior/mu"];
    assert_eq!(mu["dimension_names"], serde_json::json!(["chain", "draw", "mu_dim_0"]));
    assert_eq!(mu["shape"], serde_json::json!([4, 2000, 2]));
    assert!(!folder.path().join("posterior.zarr.partial").exists());

    let taken = folder.path().join("taken");
    fs::create_dir(&taken).expect("a folder");
    let error = posterior.write_zarr(&taken).expect_err("not a store");
    assert!(error.to_string().contains("not a Zarr store"), "{error}");
}

#[test]
fn the_gradient_of_a_model_is_checked() {
    check::gradient(&means(&Y, 1.5, 3.0), 5);
    check::gradient(&funnel(), 5);
}

/// Calibrates a fit with the noise `claimed` on data simulated with noise 1; only `claimed` = 1 is right.
fn calibrate(claimed: f64) -> check::SbcReport {
    let sampler = Nuts::default().chains(1).warmup(200).draws(396);
    let report = check::sbc(11).replications(200).sampler(sampler).run(|trial| {
        let truth = noisy(&[0.0; 5], 1.0).draw_prior(&mut trial.rng)?;
        let data = truth.replicate("y").unwrap_or_default();
        trial.rank(&noisy(data, claimed), &truth)
    });
    report.expect("the sampler runs")
}

#[test]
fn calibration_passes_a_right_model_and_fails_a_wrong_one() {
    let report = calibrate(1.0);
    assert_eq!(report.quantities[0].ranks.len(), 200);
    report.assert_uniform(1e-4);
    let wrong = calibrate(0.4);
    assert!(wrong.p_value() < 1e-6, "{wrong}");
}

/// Draws passed by parameter name give the same posterior as the chains they come from.
#[test]
fn draws_by_name_give_the_posterior() {
    let model = means(&[0.4, 1.0, 0.2], 1.1, -2.0);
    let posterior =
        Nuts::default().chains(2).warmup(200).draws(100).seed(4).sample(&model).unwrap();
    let again = Posterior::from_draws(&model, &posterior.posterior).unwrap();
    assert_eq!((again.posterior.chains, again.posterior.draws), (2, 100));
    for (a, b) in again.posterior.variables.iter().zip(&posterior.posterior.variables) {
        assert_eq!((&a.name, &a.shape), (&b.name, &b.shape));
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-10;
        assert!(a.data.iter().zip(&b.data).all(close), "{}", a.name);
    }
    assert_eq!(again.log_likelihood.variables.len(), posterior.log_likelihood.variables.len());

    let mut partial = posterior.posterior.clone();
    partial.variables.retain(|values| values.name != "idle");
    let error = Posterior::from_draws(&model, &partial).unwrap_err().to_string();
    assert!(error.contains("`idle` is missing") && error.contains("`mu`"), "{error}");
    let mut outside = posterior.posterior.clone();
    let idle = outside.variables.iter_mut().find(|values| values.name == "idle").unwrap();
    idle.data[3] = 7.0;
    let error = Posterior::from_draws(&model, &outside).unwrap_err().to_string();
    assert!(error.contains("draw 3 of chain 0") && error.contains("idle"), "{error}");
}

/// A posterior needs at least one chain, and each chain needs at least one draw.
#[test]
fn draws_without_chains_are_refused() {
    let model = means(&[0.4, 1.0, 0.2], 1.1, -2.0);
    let values = |name: &str, shape: &[usize]| Values {
        name: name.into(),
        shape: shape.to_vec(),
        data: Vec::new(),
    };
    let layout = model.layout().unwrap();
    let variables: Vec<Values> =
        layout.with_role(Role::Parameter).map(|v| values(&v.name, &v.shape)).collect();
    let none = Group { chains: 0, draws: 5, variables: variables.clone() };
    let error = Posterior::from_draws(&model, &none).unwrap_err();
    assert!(matches!(error, PosteriorError::NoChains), "{error}");
    let empty = Group { chains: 2, draws: 0, variables };
    let error = Posterior::from_draws(&model, &empty).unwrap_err();
    assert!(matches!(error, PosteriorError::NoDraws { chain: 0, .. }), "{error}");

    let mut chains = Nuts::default().chains(1).warmup(50).draws(10).run(&model).unwrap();
    chains.chains.clear();
    let error = Posterior::from_chains(&model, chains, 1).unwrap_err();
    assert!(matches!(error, PosteriorError::NoChains), "{error}");
}

/// Estimates by parameter name agree with the summary, and an error lists the valid names.
#[test]
fn estimates_have_names() {
    let model = means(&[0.4, 1.0, 0.2], 1.1, -2.0);
    let posterior =
        Nuts::default().chains(2).warmup(200).draws(200).seed(4).sample(&model).unwrap();
    let summary = posterior.summary();
    let row = summary.row("mu[1]").unwrap();
    assert_eq!(posterior.mean("mu[1]").unwrap(), row.mean);
    assert_eq!(posterior.sd("mu[1]").unwrap(), row.sd);
    assert_eq!(posterior.interval("mu[1]", 0.9).unwrap(), [row.q05, row.q95]);
    assert_eq!(posterior.quantile("mu[1]", 0.5).unwrap(), row.q50);
    assert!(posterior.mean("next").is_ok());
    let error = posterior.mean("nu").unwrap_err();
    let ppl::EstimateError::NoNumber { known, .. } = &error else { panic!("{error}") };
    assert!(known.contains(&"mu[0]".to_owned()) && known.contains(&"next".to_owned()));
    let error = posterior.interval("mu[1]", 95.0).unwrap_err();
    assert_eq!(error.to_string(), "a probability must lie between 0 and 1, got 95");
}
