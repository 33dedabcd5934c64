//! Advice of the error of a step without equilibrium, which depends on the damage and the supports of the body.

use crate::support::block::{block, even};
use crate::support::{HEIGHT, grain, loading, matrix, phase_field, prism, with_options};
use fem::{
    Axis, Conditions, End, Fracture, Material, Order, Platen, Problem, Schedule, SolverOptions,
    Split,
};

fn failure(problem: &Problem) -> String {
    let outcome = problem.run(&mut ());
    match outcome.end {
        End::Failed(error) => error.to_string(),
        end => panic!("{end:?} after {} points", outcome.curve.len()),
    }
}

fn elastic(conditions: Conditions) -> Problem {
    let cells = even(0.0, 1.0, 2);
    Problem::builder(block([&cells, &cells, &even(0.0, 2.0, 3)]))
        .materials([Material::hencky(10.0, 0.3)])
        .conditions(conditions.symmetry("left").symmetry("front"))
        .schedule(Schedule::fixed(1.0, 4))
        .build()
        .expect("valid")
}

#[test]
fn the_advice_for_an_elastic_body_does_not_mention_viscosity() {
    // a bar with Hencky's law has no equilibrium under a dead load above E/e
    let pulled = Conditions::new()
        .fix("bottom", [Axis::Z])
        .traction("top", |_, t| [0.0, 0.0, 8.0 * t])
        .measure("top", [0.0, 0.0, 1.0]);
    let message = failure(&elastic(pulled));
    assert!(!message.contains("viscosity"), "{message}");
    assert!(message.contains("prescribe displacements instead of loads"), "{message}");
}

#[test]
fn the_advice_names_a_platen_that_the_body_does_not_touch() {
    let below = Platen::plane([0.0, 0.0, -0.1], [0.0, 0.0, 1.0]);
    let dropped = Conditions::new()
        .platen("bottom", below)
        .traction("top", |_, t| [0.0, 0.0, -t])
        .measure("top", [0.0, 0.0, -1.0]);
    let message = failure(&elastic(dropped));
    assert!(message.contains("no node of surface 'bottom' touches its platen"), "{message}");
}

#[test]
fn the_advice_for_damage_mentions_viscosity_only_if_the_body_is_damaged() {
    let options = SolverOptions {
        iterations: 2,
        alternations: 1,
        tolerance: 1e-12,
        ..SolverOptions::default()
    };
    let run = |viscosity_mpa_s: f64| {
        let fracture = matrix().fracture.expect("a toughness");
        let weak = matrix().with_fracture(Fracture { viscosity_mpa_s, ..fracture });
        let stiff = Material { fracture: None, ..grain() };
        let (mesh, field) = (prism(2, true), Some(phase_field(Split::None)));
        let way = loading(0.3 * HEIGHT, 1.0, 8);
        let problem = with_options(mesh, Order::Linear, vec![weak, stiff], field, way, options);
        problem.expect("valid input").run(&mut ())
    };
    // the body is not damaged when the step fails, so the advice must not mention the viscosity of damage
    let End::Failed(error) = run(0.3).end else { panic!("it converged in two iterations") };
    assert!(!error.to_string().contains("viscosity"), "{error}");
}
