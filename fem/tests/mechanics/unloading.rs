//! Unloading to zero, and rigid motions. The forces vanish in these states, but the reference value of the convergence
//! test must not vanish.

use crate::support::block::{block, even};
use crate::support::{RADIUS, grain, matrix, phase_field, prism};
use fem::{
    Axis, Conditions, CrackDensity, End, Fracture, Irreversibility, LinearScheme, Material, Order,
    Outcome, PhaseField, Problem, Schedule, SolverOptions, Split,
};

/// Loading history: load in four steps, unload to zero in four steps, load again in two steps.
fn there_and_back(t: f64) -> f64 {
    match t {
        t if t < 4.0 => t / 4.0,
        t if t < 8.0 => (8.0 - t) / 4.0,
        t => (t - 8.0) / 4.0,
    }
}

fn pressed(full_mm: f64) -> Conditions {
    Conditions::new()
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, -full_mm * there_and_back(t)])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, -1.0])
}

fn run(
    order: Order,
    materials: Vec<Material>,
    field: Option<PhaseField>,
    conditions: Conditions,
    options: SolverOptions,
) -> Outcome {
    let mesh = prism(2, true);
    let problem = Problem::builder(mesh)
        .order(order)
        .materials(materials)
        .phase_field(field)
        .conditions(conditions)
        .schedule(Schedule::fixed(10.0, 10))
        .options(options)
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{order:?} {field:?}: {:?}", outcome.end);
    // with platens, every node changes its contact state at zero load, so that shorter steps may be necessary
    let cuts = outcome.effort.cuts;
    let platens = !outcome.contact.is_empty();
    assert!(cuts == 0 || platens && cuts < 3, "{order:?} {field:?}: {:?}", outcome.effort);
    outcome
}

#[test]
fn an_elastic_body_returns_to_zero_load() {
    let solids = vec![Material::hencky(275.0, 0.25), Material::neo_hookean(22_000.0, 0.25)];
    for order in [Order::Linear, Order::Quadratic] {
        for linear in [LinearScheme::Direct, LinearScheme::Multigrid] {
            for tolerance in [1e-6, 1e-8, 1e-11] {
                let options = SolverOptions { linear, tolerance, ..SolverOptions::default() };
                let outcome = run(order, solids.clone(), None, pressed(0.1), options);
                let (most, rest) = (outcome.curve[3].force_n, outcome.curve[7]);
                assert!(rest.force_n.abs() <= 10.0 * tolerance * most, "{rest:?}");
                // loading again gives the force of the first loading
                assert!((outcome.curve[9].force_n / outcome.curve[1].force_n - 1.0).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn a_damaged_body_returns_to_zero_load() {
    use Irreversibility::{ActiveSet, History, None as Heals};
    let at1 = |irreversibility| PhaseField {
        model: CrackDensity::At1,
        irreversibility,
        ..PhaseField::new(0.5)
    };
    let at2 = |split, irreversibility| PhaseField { irreversibility, ..phase_field(split) };
    let tough = Fracture { toughness_n_per_mm: 0.05, ..matrix().fracture.expect("a toughness") };
    for (field, fracture) in [
        (at2(Split::None, Heals), matrix().fracture),
        (at2(Split::None, ActiveSet), matrix().fracture),
        (at2(Split::VolumetricDeviatoric, History), matrix().fracture),
        (at2(Split::Spectral, ActiveSet), matrix().fracture),
        (at1(Heals), Some(tough)),
        (at1(ActiveSet), Some(tough)),
    ] {
        let solids = vec![Material { fracture, ..matrix() }, grain()];
        let outcome =
            run(Order::Linear, solids, Some(field), pressed(0.06), SolverOptions::default());
        let (most, rest) = (outcome.curve[3].force_n, outcome.curve[7]);
        assert!(rest.force_n.abs() < 1e-6 * most, "{field:?}: {rest:?}");
        assert!(outcome.curve[3].phi_max > 1e-3, "{field:?}: {:?}", outcome.curve[3]);
    }
}

#[test]
fn a_traction_is_removed() {
    let solids = vec![Material::hencky(275.0, 0.25), Material::hencky(22_000.0, 0.25)];
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .traction("top", |_, t| [0.0, 0.0, -5.0 * there_and_back(t)])
        .measure("top", [0.0, 0.0, -1.0]);
    let outcome = run(Order::Quadratic, solids, None, conditions, SolverOptions::default());
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    assert!((outcome.curve[3].force_n - 5.0 * area).abs() < 1e-9 * area);
    let rest = outcome.curve[7];
    assert!(rest.displacement_mm.abs() < 1e-6 * outcome.curve[3].displacement_mm, "{rest:?}");
    assert!(rest.force_n.abs() < 1e-12, "{rest:?}");
}

#[test]
fn unilateral_platens_lift_off_at_zero_load() {
    let solids = vec![Material::hencky(275.0, 0.25), Material::hencky(22_000.0, 0.25)];
    let platen = |level: f64, up: f64| fem::Platen::plane([0.0, 0.0, level], [0.0, 0.0, up]);
    let top = platen(4.4, -1.0).moving(|t| [0.0, 0.0, -0.05 * there_and_back(t)]);
    let conditions = Conditions::new()
        .platen("bottom", platen(0.0, 1.0))
        .platen("top", top)
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, -1.0]);
    let outcome = run(Order::Linear, solids, None, conditions, SolverOptions::default());
    let (most, rest) = (outcome.curve[3].force_n, outcome.curve[7]);
    assert!(most > 1.0 && rest.force_n.abs() < 1e-6 * most, "{most} N, {rest:?}");
}

#[test]
fn a_rigid_motion_needs_no_force() {
    // a translation, and a rotation by 60° in ten steps, prescribed on all faces
    let turn = |x: [f64; 3], t: f64| {
        let (sin, cos) = (t * 0.1 * std::f64::consts::FRAC_PI_3).sin_cos();
        [cos * x[0] - sin * x[1] - x[0], sin * x[0] + cos * x[1] - x[1], 0.0]
    };
    let shift = |_: [f64; 3], t: f64| [0.3 * t, -0.2 * t, 0.1 * t];
    for order in [Order::Linear, Order::Quadratic] {
        for tolerance in [1e-4, 1e-8, 1e-12] {
            for moves in [true, false] {
                let faces = ["left", "right", "front", "back", "bottom", "top"];
                let conditions = faces.iter().fold(Conditions::new(), |c, face| match moves {
                    true => c.prescribe(face, Axis::ALL, shift),
                    false => c.prescribe(face, Axis::ALL, turn),
                });
                let cells = even(0.0, 2.0, 4);
                let problem = Problem::builder(block([&cells, &cells, &cells]))
                    .order(order)
                    .materials([Material::hencky(275.0, 0.25)])
                    .conditions(conditions.measure("top", [0.0, 0.0, 1.0]))
                    .schedule(Schedule::fixed(10.0, 10))
                    .options(SolverOptions { tolerance, ..SolverOptions::default() })
                    .build()
                    .expect("valid");
                let outcome = problem.run(&mut ());
                let case = format!("{order:?} {tolerance:e} {moves}");
                assert!(matches!(outcome.end, End::Displacement), "{case}: {:?}", outcome.end);
                assert_eq!(outcome.effort.cuts, 0, "{case}: {:?}", outcome.effort);
                let last = outcome.curve[9];
                assert!(
                    last.elastic_n_mm < 1e-15 && last.force_n.abs() < 1e-10,
                    "{case}: {last:?}"
                );
            }
        }
    }
}
