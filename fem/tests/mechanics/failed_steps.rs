//! Newton steps that the line search shortens, and increments that are cut.

use crate::support::{HEIGHT, grain, matrix, phase_field, prism, with_options};
use fem::{
    Axis, CompressionTest, Conditions, End, HyperelasticLaw, Irreversibility, Material, Order,
    PhaseField, PrincipalStrain, Problem, Progress, Scalar, Schedule, SolverOptions, Split, Step,
    StepController,
};

/// ψ = S ε₀ Σ (√(1 + (ε_i/ε₀)²) − 1): the stress saturates at S, and Newton's method without a line search takes
/// ε/ε₀ to −(ε/ε₀)³ when the load is removed.
#[derive(Debug)]
struct Saturating;

const SATURATED_MPA: f64 = 10.0;
const KNEE: f64 = 1e-3;

impl HyperelasticLaw for Saturating {
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let [a, b, c] = strain.log().map(|e| {
            let x = e / KNEE;
            (x * x + 1.0).sqrt()
        });
        (a + b + c - 3.0) * (SATURATED_MPA * KNEE)
    }
}

#[test]
fn the_line_search_unloads_a_bar_whose_stress_saturates() {
    let pull = |time_s: f64| if time_s < 0.95 { 0.95 * SATURATED_MPA * time_s / 0.9 } else { 0.0 };
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .traction("top", move |_, time_s| [0.0, 0.0, pull(time_s)])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, 1.0]);
    let problem = Problem::builder(prism(1, false))
        .materials([Material::hyperelastic(Saturating).expect("a law")])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 10))
        .build()
        .expect("valid input");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    assert_eq!((outcome.effort.cuts, outcome.effort.fallbacks), (0, 0), "{:?}", outcome.effort);
    let [.., loaded, unloaded] = outcome.curve[..] else { panic!("ten points") };
    // ε/ε₀ = s/√(1 − s²) with s = τ/S, and the nominal stress is τ/λ
    let knees = (loaded.displacement_mm / HEIGHT).ln_1p() / KNEE;
    let stress = knees / knees.hypot(1.0) / (knees * KNEE).exp();
    assert!((stress - 0.95).abs() < 1e-6 && knees > 3.0, "{knees} {stress}");
    assert!(unloaded.displacement_mm.abs() < 1e-6 * KNEE * HEIGHT, "{unloaded:?}");
}

/// Controller that tries a step of half the duration, which fails, before each step that succeeds.
#[derive(Debug)]
struct Hasty {
    tries: bool,
}

impl StepController for Hasty {
    fn next(&self, run: &Progress) -> Option<Step> {
        let tries = self.tries && run.failed.is_none() && run.passed < 0.5;
        Some(Step::Advance(if tries { 0.5 } else { 0.05 }))
    }
}

/// Failed increments must not change the history, although they reach larger driving energies than the accepted
/// increments.
#[test]
fn an_increment_that_is_cut_leaves_no_state() {
    let field =
        PhaseField { irreversibility: Irreversibility::History, ..phase_field(Split::None) };
    let options = SolverOptions { alternations: 25, ..SolverOptions::default() };
    let [plain, hasty] = [false, true].map(|tries| {
        let loading = CompressionTest::new(0.3, Schedule::new(1.0, Hasty { tries }));
        let materials = vec![matrix(), grain()];
        let problem =
            with_options(prism(2, true), Order::Linear, materials, Some(field), loading, options);
        let outcome = problem.expect("valid input").run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        outcome
    });
    assert_eq!(plain.effort.cuts, 0);
    assert!(hasty.effort.cuts > 4, "{:?}", hasty.effort);
    assert_eq!(plain.curve.len(), hasty.curve.len());
    for (a, b) in plain.curve.iter().zip(&hasty.curve) {
        assert!((a.force_n - b.force_n).abs() < 1e-5 * a.force_n, "{a:?}\n{b:?}");
    }
}
