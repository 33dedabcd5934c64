//! Names, prior draws, predictions and rejections of models.

use std::collections::BTreeMap;

use ppl::prelude::*;
use ppl::{Bound, Model, Rejection, Role, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::models::*;

fn names(model: &Bound<impl Model>) -> Vec<(String, Vec<usize>, Role)> {
    let variables = &model.layout().unwrap().variables;
    variables.iter().map(|v| (v.name.clone(), v.shape.clone(), v.role)).collect()
}

fn named(expected: &[(&str, &[usize], Role)]) -> Vec<(String, Vec<usize>, Role)> {
    expected.iter().map(|(name, shape, role)| (name.to_string(), shape.to_vec(), *role)).collect()
}

#[test]
fn names_and_shapes() {
    use Role::{Observed, Parameter, Predicted, Tracked};
    assert_eq!(
        names(&calibration(&Curve, &QOIS)),
        named(&[
            ("young", &[], Parameter),
            ("toughness", &[], Parameter),
            ("viscosity", &[], Parameter),
            ("sd", &[3], Parameter),
            ("corr", &[3, 3], Parameter),
            ("mean", &[3], Tracked),
            ("y", &[2, 3], Observed),
            ("new_specimen", &[3], Predicted),
        ])
    );
    assert_eq!(
        names(&schools_in_a_plate(&EFFECTS, &ERRORS))[2..],
        named(&[("theta", &[8], Parameter), ("y", &[8], Observed)])
    );
    assert_eq!(
        names(&regression(&ROWS, &[0.3, 1.2, 1.9])),
        named(&[
            ("intercept", &[], Parameter),
            ("slope", &[2], Parameter),
            ("sd", &[], Parameter),
            ("y", &[3], Observed),
            ("fitted", &[3], Predicted),
            ("y_new", &[3], Predicted),
        ])
    );
    assert_eq!(
        names(&places(&(0.7, 1.1), &SPECIMENS, &true))[2..],
        named(&[
            ("pair.0", &[], Observed),
            ("pair.1", &[], Observed),
            ("s.slope", &[2], Observed),
            ("s.peak", &[2], Observed),
            ("flag", &[], Observed),
        ])
    );
    // arms of a branch may share a name, and only the arm that runs declares it
    let both = branches(true, Some(1.0), 2, &[0.1, f64::NAN, 0.3]);
    assert_eq!(
        names(&both),
        named(&[
            ("mean", &[], Parameter),
            ("free", &[], Parameter),
            ("heavy", &[], Parameter),
            ("y", &[2], Observed),
        ])
    );
    assert_eq!(branches(false, None, 0, &[0.1]).layout().unwrap().dim, 1);
    assert_eq!(hierarchy(5, vec![0], vec![1]).layout().unwrap().dim, 7);
}

#[test]
fn values_at_a_point() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let model = walk(&[0.1, 0.4]);
    let (phi, sd) = (0.5, 2.0f64);
    let y = [(1.5f64 / 0.5).ln(), sd.ln(), 0.3, -0.2];
    let record = model.constrain(&y, &mut rng).unwrap();
    let value = |name: &str| record.values(name).unwrap();
    approx::assert_relative_eq!(value("phi")[0], phi, max_relative = 1e-14);
    assert_eq!(value("step"), [0.3, -0.2]);
    approx::assert_relative_eq!(value("last")[0], phi * 0.3 - 0.2, max_relative = 1e-13);
    let change = value("next")[0] - value("last")[0];
    assert_eq!(value("change")[0], change);
    let observed = record.get("y").unwrap();
    assert_eq!(observed.values, [0.1, 0.4]);
    assert_eq!((observed.replicate.len(), observed.log_likelihood.len()), (2, 2));
    let ln_density: f64 = Normal(0.3, 0.5).ln_density(&0.1);
    approx::assert_relative_eq!(observed.log_likelihood[0], ln_density, max_relative = 1e-13);
}

/// Prior draws and predictions have the distributions of their statements: means within 4 standard errors.
#[test]
fn prior_draws() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let model = walk(&[0.1, 0.4]);
    let n = 4000;
    let mut columns: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for _ in 0..n {
        let record = model.draw_prior(&mut rng).unwrap();
        let scale = record.values("sd").unwrap()[0];
        for name in ["phi", "sd"] {
            columns.entry(name).or_default().push(record.values(name).unwrap()[0]);
        }
        // standardised with the location and scale of their distributions
        let next = record.values("next").unwrap()[0];
        let centre = record.values("phi").unwrap()[0] * record.values("last").unwrap()[0];
        columns.entry("next").or_default().push((next - centre) / scale);
        let replicate = &record.get("y").unwrap().replicate;
        let state = record.values("step").unwrap()[0];
        columns.entry("y").or_default().push((replicate[0] - state) / 0.5);
    }
    let half_normal = (2.0 / std::f64::consts::PI).sqrt();
    let expected = [
        ("phi", 0.0, 1.0 / 3.0),
        ("sd", half_normal, 1.0 - half_normal * half_normal),
        ("next", 0.0, 1.0),
        ("y", 0.0, 1.0),
    ];
    for (name, mean, variance) in expected {
        let found = columns[name].iter().sum::<f64>() / f64::from(n);
        let error = (variance / f64::from(n)).sqrt();
        assert!((found - mean).abs() < 4.0 * error, "{name}: {found} against {mean} ± {error}");
    }
}

#[test]
fn rejections_know_their_place() {
    let model = limited(&Curve, 3.0);
    let mut w = Workspace::default();
    let at = |x: f64, w: &mut Workspace| model.log_density(&[x], w).unwrap_err();

    let above = at(4.0, &mut w);
    assert_eq!(above.to_string().lines().count(), 1);
    let Rejection::Reject { location, message } = above else { panic!("not a rejection: {above}") };
    assert_eq!(message, "4 is above 3");
    assert!(location.file.ends_with("models.rs") && location.line > 1, "{location}");
    assert_eq!(location.statement, r#"reject!("{x} is above {limit}")"#);

    let Rejection::Domain { location, error } = at(0.5, &mut w) else { panic!("in the domain") };
    assert_eq!(location.statement, "let value = f.try_at([x, x, x])?[1]");
    assert_eq!(error.to_string(), "a must be above 1, got 0.5");

    let source = std::fs::read_to_string(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../ppl/tests/language/models.rs"
    ));
    let source = source.unwrap();
    let line = source.lines().nth(location.line as usize - 1).unwrap();
    assert_eq!(line.trim(), format!("{};", location.statement));
}

/// An unread coordinate would have a flat density; the run stops with an error instead.
#[test]
fn the_number_of_unknowns_is_fixed() {
    ppl::model! {
        fn changing(limit: f64) {
            let x ~ Normal(0.0, 1.0);
            if x > limit {
                let extra ~ Normal(x, 1.0);
                factor(-extra.square());
            }
        }
    }
    let model = changing(-10.0);
    assert_eq!(model.dim(), 2);
    let (mut w, mut gradient) = (Workspace::default(), [0.0; 2]);
    assert!(model.log_density(&[0.3, 0.1], &mut w).is_ok());
    let outcomes = [
        model.log_density(&[-11.0, 0.1], &mut w),
        model.gradient(&[-11.0, 0.1], &mut gradient, &mut w),
        model.forward_gradient(&[-11.0, 0.1], &mut gradient),
        model.log_density(&[0.3], &mut w),
    ];
    for outcome in outcomes {
        assert!(matches!(outcome, Err(Rejection::Fatal(_))), "{outcome:?}");
    }
}

/// Evaluations of the density do not run `#[predict]` statements.
#[test]
fn predictions_wait_for_finished_draws() {
    use std::sync::atomic::{AtomicUsize, Ordering};

    ppl::model! {
        fn counted(calls: &AtomicUsize) {
            let x ~ Normal(0.0, 1.0);
            #[predict] let calls = calls.fetch_add(1, Ordering::Relaxed) as f64 + 0.0 * x;
        }
    }
    let calls = AtomicUsize::new(0);
    let model = counted(&calls);
    let at_binding = calls.load(Ordering::Relaxed);
    let (mut w, mut gradient) = (Workspace::default(), [0.0]);
    for _ in 0..10 {
        model.log_density(&[0.1], &mut w).unwrap();
        model.gradient(&[0.1], &mut gradient, &mut w).unwrap();
    }
    assert_eq!(calls.load(Ordering::Relaxed), at_binding);
    model.constrain(&[0.1], &mut Xoshiro256PlusPlus::seed_from_u64(0)).unwrap();
    assert_eq!(calls.load(Ordering::Relaxed), at_binding + 1);
}
