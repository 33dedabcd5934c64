//! Prescribed values that jump: in the first step without an initial guess, or in a later step.

use crate::support::block::{block, even};
use crate::support::{HEIGHT, prism};
use fem::{Axis, Conditions, End, Material, Order, Outcome, Problem, Schedule, SolverOptions};

/// Compressive strain of the block, applied in one step. With a strain of 0.15 and ν = 0.499, quadratic elements would
/// need reduced steps: three with an initial guess, one without.
const PRESSED: f64 = 0.05;

/// Compresses a rubber block with fixed ends in one step.
fn glued(order: Order, poisson: f64, guess: bool) -> Outcome {
    let cells = even(0.0, 2.0, 4);
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .prescribe("top", Axis::ALL, |_, t| [0.0, 0.0, -PRESSED * 2.0 * t])
        .measure("top", [0.0, 0.0, -1.0]);
    let conditions = match guess {
        true => conditions.first_guess(|x, t| [0.0, 0.0, -PRESSED * t * x[2]]),
        false => conditions,
    };
    let problem = Problem::builder(block([&cells, &cells, &cells]))
        .order(order)
        .materials([Material::neo_hookean(1.0, poisson)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{order:?} {poisson}: {:?}", outcome.end);
    outcome
}

#[test]
fn a_first_step_without_an_initial_guess_needs_few_additional_iterations() {
    for order in [Order::Linear, Order::Quadratic] {
        for poisson in [0.3, 0.499] {
            let (with, without) = (glued(order, poisson, true), glued(order, poisson, false));
            let case = format!("{order:?} {poisson}: {:?} {:?}", with.effort, without.effort);
            assert_eq!(without.effort.cuts, 0, "{case}");
            assert!(without.effort.iterations <= with.effort.iterations + 4, "{case}");
            assert!(without.effort.factorisations <= with.effort.factorisations + 2, "{case}");
            let forces = [&with, &without].map(|outcome| outcome.curve[0].force_n);
            assert!((forces[0] / forces[1] - 1.0).abs() < 1e-6, "{case}: {forces:?} N");
        }
    }
}

#[test]
fn a_later_jump_of_the_displacement_needs_no_initial_guess() {
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .prescribe("top", Axis::ALL, |_, t| [0.0, 0.0, if t < 2.5 { 0.0 } else { -0.6 }])
        .measure("top", [0.0, 0.0, -1.0]);
    let problem = Problem::builder(prism(4, false))
        .order(Order::Quadratic)
        .materials([Material::hencky(1.0, 0.45)])
        .conditions(conditions)
        .schedule(Schedule::fixed(4.0, 4))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let effort = outcome.effort;
    assert!(effort.cuts == 0 && effort.iterations < 20, "{effort:?}");
    assert!(outcome.curve[1].force_n == 0.0 && outcome.curve[2].force_n > 0.05 * HEIGHT);
}

#[test]
fn the_curve_counts_the_iterations_of_failed_steps() {
    // four iterations are too few for these steps, so that steps fail and are reduced
    let options = SolverOptions { iterations: 4, alternations: 1, ..SolverOptions::default() };
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .prescribe("top", Axis::ALL, |_, t| [0.0, 0.0, -1.5 * t])
        .measure("top", [0.0, 0.0, -1.0]);
    let problem = Problem::builder(prism(2, false))
        .materials([Material::neo_hookean(1.0, 0.45)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 2))
        .options(options)
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    assert!(outcome.effort.cuts > 0, "{:?}", outcome.effort);
    let sum: u32 = outcome.curve.iter().map(|p| p.newton).sum();
    assert_eq!(sum, outcome.effort.iterations);
    let sum: u32 = outcome.curve.iter().map(|p| p.linear).sum();
    assert_eq!(sum, outcome.effort.linear);
}
