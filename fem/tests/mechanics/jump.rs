//! Prescribed values that jump: the first step without a guess, and a turn on the way.

use crate::support::block::{block, even};
use crate::support::{HEIGHT, prism};
use fem::{Axis, Conditions, End, Material, Order, Outcome, Problem, Schedule, SolverOptions};

/// Strain of the block in its only step. At 0.15 and ν = 0.499 quadratic elements need cuts from both starts: three with
/// the guess, one without it.
const PRESSED: f64 = 0.05;

/// A rubber block between glued plates, pressed in one step.
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
fn a_first_step_without_a_guess_costs_hardly_more_than_one_with() {
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
fn a_program_that_waits_and_then_jumps_needs_no_guess_either() {
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
fn tries_without_equilibrium_are_in_the_column() {
    // three iterations are too few for these steps
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
