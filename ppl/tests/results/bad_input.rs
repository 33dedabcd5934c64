//! Invalid input is rejected with an error that names the input, before any work is lost.

use ppl::prelude::*;
use ppl::{Bound, Map, Model, OptimizeError, Posterior, WarningKind, Workspace};

ppl::model! {
    fn level(x: &[f64], y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(mean * x, 1.0);
        }
    }

    fn grouped(group: &[usize], y: &[f64]) {
        let level ~ Normal(0.0, 1.0).iid(2);
        for (g, y) in group.iter().zip(y) {
            y ~ Normal(level[*g], 1.0);
        }
    }

    fn predicted(x: &[Vec<f64>], y: &[f64]) {
        let slope ~ Normal(0.0, 1.0).array::<2>();
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(dot(x, &slope), 1.0);
        }
    }

    fn paired(pairs: &[[f64; 2]], counts: &[u64]) {
        let share ~ Beta(1.0, 1.0);
        let mean ~ Normal(0.0, 1.0).array::<2>();
        for pair in pairs {
            pair ~ Normal(mean[0] + mean[1], 1.0).array::<2>();
        }
        for i in 0..counts.len() {
            counts[i] ~ Binomial(5u64, share);
        }
    }

    fn one(y: f64) {
        let mean ~ Normal(0.0, 1.0);
        y ~ Normal(mean, 1.0);
    }

    /// A factor exp(−½ √(x²)), which is not differentiable at x = 0.
    fn without_tangent(y: f64) {
        let x ~ Normal(0.0, 1.0);
        let size = x.square().sqrt();
        y ~ Normal(0.3, 1.0);
        factor(-0.5 * size);
    }

    fn nothing(y: f64) {
        y ~ Normal(0.0, 1.0);
    }
}

fn refusal<M: Model>(model: &Bound<M>) -> [String; 2] {
    [
        Nuts::default().run(model).expect_err("no start").to_string(),
        Map::default().find(model).expect_err("no start").to_string(),
    ]
}

/// The sampler and the gradient check name the statement whose derivative is NaN.
#[test]
fn the_statement_without_gradient_is_named() {
    let model = without_tangent(0.3);
    let error = Nuts::default().init_points(vec![vec![0.0]; 4]).run(&model).expect_err("no start");
    let words = "the first statement whose derivative is not finite is `factor(-0.5 * size)`";
    assert!(error.to_string().contains(words), "{error}");
    let error = ppl::check::gradient_at(&model, &[0.0]).expect_err("no gradient").to_string();
    assert!(error.contains("∂/∂y[0] is NaN") && error.contains(words), "{error}");
    assert!(ppl::check::gradient_at(&model, &[0.5]).is_ok());
}

/// An observation whose log-density is not finite at any point is named by its index and value.
#[test]
fn the_datum_at_fault_is_named() {
    let mut y = vec![0.5; 1000];
    y[777] = f64::NAN;
    for said in refusal(&level(&[1.0; 1000], &y)) {
        assert!(said.contains("the first rejected observation is `y[777]` = NaN"), "{said}");
    }
    // a covariate that is not finite makes a parameter of the distribution invalid
    let mut x = [1.0; 4];
    x[2] = f64::INFINITY;
    for said in refusal(&level(&x, &[0.25; 4])) {
        assert!(said.contains("the first rejected observation is `y[2]` = 0.25"), "{said}");
        assert!(!said.contains("impute"), "{said}");
    }
    for said in refusal(&paired(&[[0.1, 0.2], [0.3, f64::NAN]], &[])) {
        assert!(
            said.contains("the first rejected observation is `pair[1]` = [0.3, NaN]"),
            "{said}"
        );
    }
    for said in refusal(&paired(&[], &[5, 0, 6])) {
        assert!(said.contains("the first rejected observation is `counts[2]` = 6"), "{said}");
    }
    for said in refusal(&one(f64::NAN)) {
        assert!(said.contains("the first rejected observation is `y` = NaN"), "{said}");
        assert!(said.contains("pass them as `Option<f64>` and write `y.impute() ~ …`"), "{said}");
    }
}

#[test]
fn a_model_without_unknowns_has_no_mode() {
    let found = Map::default().find(&nothing(0.3));
    assert!(matches!(found, Err(OptimizeError::NoUnknowns)));
    assert!(matches!(
        ppl::Laplace::new(&nothing(0.3), &Map::default()),
        Err(OptimizeError::NoUnknowns)
    ));
}

#[test]
fn a_gradient_needs_as_much_room_as_the_point() {
    let (model, mut workspace) = (level(&[1.0], &[0.3]), Workspace::default());
    for room in [0, 2] {
        let mut gradient = vec![0.0; room];
        for refused in [
            model.gradient(&[0.1], &mut gradient, &mut workspace),
            model.tape_gradient(&[0.1], &mut gradient, &mut workspace),
        ] {
            let said = refused.expect_err("another length").to_string();
            assert!(
                said.contains(&format!("gradient has length {room} and the point has length 1")),
                "{said}"
            );
        }
    }
}

#[test]
fn settings_beyond_any_machine_are_refused() {
    let model = level(&[1.0], &[0.3]);
    let nuts = Nuts::default;
    for (sampler, setting) in [
        (nuts().chains(usize::MAX), "chains"),
        (nuts().threads(100_000), "threads"),
        (nuts().thin(usize::MAX), "thin"),
        (nuts().draws(usize::MAX), "draws"),
    ] {
        let said = sampler.run(&model).expect_err("too much").to_string();
        assert!(said.contains(&format!("setting `{setting}`")), "{said}");
    }
}

#[test]
fn chains_go_on_with_the_thinning_they_began_with() {
    let model = level(&[1.0], &[0.3]);
    let nuts = Nuts::default().chains(1).warmup(50).seed(3);
    let earlier = nuts.clone().thin(3).draws(10).run(&model).expect("runs");
    let said = nuts.clone().draws(20).resume(&model, earlier.clone()).expect_err("another thin");
    assert!(said.to_string().contains("one of 3 transitions but `thin` is 1"), "{said}");
    nuts.thin(3).draws(20).resume(&model, earlier).expect("the same thin");
}

#[test]
fn chains_cut_by_hand_make_no_posterior() {
    let model = level(&[1.0], &[0.3]);
    let mut chains = Nuts::default().warmup(50).draws(50).run(&model).expect("runs");
    chains.chains[2].draws.truncate(30);
    let said = Posterior::from_chains(&model, chains, 1).expect_err("lengths").to_string();
    assert!(said.contains("chain 2 has 30 numbers, not 50"), "{said}");
}

fn kinds(posterior: &Posterior) -> Vec<WarningKind> {
    posterior.summary().warnings.iter().map(|finding| finding.kind).collect()
}

#[test]
fn draws_of_another_density_are_told_from_its_own() {
    let model = level(&[1.0], &[0.3]);
    let chains = Nuts::default().run(&model).expect("runs");
    let own = Posterior::from_chains(&model, chains.clone(), 1).expect("fits");
    assert!(!kinds(&own).contains(&WarningKind::OtherDensity));
    // evaluating the density of held-out data at these draws is the intended use of such a call
    let held_out = level(&[2.0], &[1.3]);
    let other = Posterior::from_chains(&held_out, chains, 1).expect("the same unknowns");
    assert!(kinds(&other).contains(&WarningKind::OtherDensity));
}

/// Data whose sizes disagree with each other give an error of the model that names the statement.
#[test]
fn data_that_do_not_fit_one_another_are_named() {
    let said = |layout: Result<_, ppl::ModelError>| match layout {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    };
    let message = said(grouped(&[0, 2], &[0.1, 0.2]).layout().map(|layout| layout.dim));
    for part in ["the len is 2 but the index is 2", "`y ~ Normal(level[*g], 1.0)`"] {
        assert!(message.contains(part), "{message}");
    }
    let x = [vec![1.0, 2.0, 3.0]];
    let message = said(predicted(&x, &[0.1]).layout().map(|layout| layout.dim));
    for part in ["`dot` multiplies 3 data with 2 unknowns", "y ~ Normal(dot(x, &slope), 1.0)"] {
        assert!(message.contains(part), "{message}");
    }
    assert!(predicted(&[vec![1.0, 2.0]], &[0.1]).layout().is_ok());
}
