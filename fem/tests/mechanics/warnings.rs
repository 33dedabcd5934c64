//! What spoils a result without an error: elements that lock, parts that hang together by an edge.

use crate::support::block::{block, even};
use crate::support::{loading, prism};
use fem::{Axis, Conditions, End, Material, Order, Problem, ProblemWarning, Schedule, TetMesh};

fn held(mesh: TetMesh, order: Order, poisson: f64, surface: &str) -> Problem {
    Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(1.0, poisson)])
        .conditions(Conditions::new().fix(surface, Axis::ALL))
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid")
}

/// A rubber block between glued plates: its force by linear elements over that by quadratic ones.
fn volumetric(poisson: f64, cells: usize) -> f64 {
    let cells = even(0.0, 2.0, cells);
    let [linear, quadratic] = [Order::Linear, Order::Quadratic].map(|order| {
        let conditions = Conditions::new()
            .fix("bottom", Axis::ALL)
            .prescribe("top", Axis::ALL, |_, t| [0.0, 0.0, -0.02 * t])
            .measure("top", [0.0, 0.0, -1.0]);
        let problem = Problem::builder(block([&cells, &cells, &cells]))
            .order(order)
            .materials([Material::hencky(1.0, poisson)])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 1))
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        outcome.curve[0].force_n
    });
    println!("{poisson} {}: {}", cells.len() - 1, linear / quadratic);
    linear / quadratic
}

/// A bar on one end, its deflection by linear elements over that of beam theory.
fn bending(cells: [usize; 2], slenderness: f64) -> f64 {
    let (across, along) = (even(0.0, 1.0, cells[0]), even(0.0, slenderness, cells[1]));
    let mesh = block([&across, &across, &along]);
    let load = 1e-6;
    let conditions = Conditions::new()
        .fix("bottom", Axis::ALL)
        .traction("top", move |_, t| [load * t, 0.0, 0.0])
        .measure("top", [1.0, 0.0, 0.0]);
    let problem = Problem::builder(mesh)
        .materials([Material::hencky(1000.0, 0.0)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 1))
        .build()
        .expect("valid");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let exact = load * slenderness.powi(3) / (3.0 * 1000.0 / 12.0);
    println!("{cells:?} {slenderness}: {}", outcome.curve[0].displacement_mm / exact);
    outcome.curve[0].displacement_mm / exact
}

#[test]
fn linear_elements_that_lock_are_named() {
    for poisson in [0.3, 0.4, 0.45, 0.47, 0.48, 0.49, 0.495, 0.499, 0.4999] {
        for cells in [3, 6] {
            volumetric(poisson, cells);
        }
    }
    for (cells, slenderness) in [
        ([1, 10], 10.0),
        ([1, 10], 100.0),
        ([1, 100], 100.0),
        ([2, 20], 10.0),
        ([3, 30], 10.0),
        ([4, 40], 10.0),
        ([6, 60], 10.0),
        ([8, 80], 10.0),
    ] {
        bending(cells, slenderness);
    }
    let _ = (loading(0.1, 1.0, 1), prism(1, false));
}
