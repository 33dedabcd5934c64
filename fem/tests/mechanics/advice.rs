//! What a run without equilibrium advises: it depends on what the body is.

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
fn an_elastic_body_is_not_told_of_viscosity() {
    // a bar of Hencky's law carries no dead load above E/e
    let pulled = Conditions::new()
        .fix("bottom", [Axis::Z])
        .traction("top", |_, t| [0.0, 0.0, 8.0 * t])
        .measure("top", [0.0, 0.0, 1.0]);
    let message = failure(&elastic(pulled));
    assert!(!message.contains("viscosity"), "{message}");
    assert!(message.contains("prescribe displacements instead of loads"), "{message}");
}

#[test]
fn a_body_that_does_not_touch_its_platen_is_told_so() {
    let below = Platen::plane([0.0, 0.0, -0.1], [0.0, 0.0, 1.0]);
    let dropped = Conditions::new()
        .platen("bottom", below)
        .traction("top", |_, t| [0.0, 0.0, -t])
        .measure("top", [0.0, 0.0, -1.0]);
    let message = failure(&elastic(dropped));
    assert!(message.contains("no node of surface 'bottom' touches its platen"), "{message}");
}

#[test]
fn damage_is_told_of_what_drives_it() {
    let options = SolverOptions {
        iterations: 2,
        alternations: 1,
        tolerance: 1e-12,
        ..SolverOptions::default()
    };
    let told = |viscosity_mpa_s: f64| {
        let fracture = matrix().fracture.expect("a toughness");
        let weak = matrix().with_fracture(Fracture { viscosity_mpa_s, ..fracture });
        let stiff = Material { fracture: None, ..grain() };
        let (mesh, field) = (prism(2, true), Some(phase_field(Split::None)));
        let way = loading(0.3 * HEIGHT, 1.0, 8);
        let problem = with_options(mesh, Order::Linear, vec![weak, stiff], field, way, options);
        problem.expect("valid input").run(&mut ())
    };
    // sound so far: nothing about damage
    let End::Failed(error) = told(0.3).end else { panic!("it converged in two iterations") };
    assert!(!error.to_string().contains("viscosity"), "{error}");
}
