//! Volumetric locking in the plastic range: the limit load of a deeply notched strip in plane strain.

use crate::support::block::{block, even, graded};
use fem::{Axis, Conditions, End, Material, Order, Plasticity, Problem, Schedule};

const YOUNG_MPA: f64 = 200_000.0;
const YIELD_MPA: f64 = 0.2;
/// Half the width of the strip and half its height, mm; half the width of the ligament is 1 mm.
const WIDTH_MM: f64 = 10.0;
const HEIGHT_MM: f64 = 15.0;

/// Mean stress of the ligament divided by the yield stress, after each step. The ligament has n cells.
fn stresses(n: usize, order: Order, steps: u32) -> Vec<f64> {
    let h = 1.0 / n as f64;
    let outwards = |to: f64| graded(h, n, 1.3, to);
    let mut along = even(0.0, 1.0, n);
    along.extend(outwards(WIDTH_MM - 1.0).into_iter().skip(1).map(|x| 1.0 + x));
    let mesh = block([&along, &outwards(HEIGHT_MM), &[0.0, h]]).with_surfaces(|x, normal| {
        let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))?;
        match axis {
            0 => (x[0] < 1e-9).then_some("left"),
            1 if x[1] > 1e-9 => Some("top"),
            1 => (x[0] < 1.0).then_some("ligament"),
            _ => Some("sides"),
        }
    });
    let end_mm = 120.0 * YIELD_MPA / YOUNG_MPA;
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("ligament")
        .fix("sides", [Axis::Z])
        .prescribe("top", [Axis::Y], move |_, time_s| [0.0, end_mm * time_s, 0.0])
        .measure("top", [0.0, 1.0, 0.0]);
    let law = Plasticity::new(YIELD_MPA);
    let problem = Problem::builder(mesh)
        .order(order)
        .materials([Material::hencky(YOUNG_MPA, 0.3).with_plasticity(law)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, steps))
        .build()
        .expect("valid input");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let stresses: Vec<f64> =
        outcome.curve.iter().map(|point| point.force_n / (h * YIELD_MPA)).collect();
    println!(
        "{order:?}, {n} cells, {} unknowns, {} iterations: {stresses:.4?}",
        problem.unknowns(),
        outcome.effort.iterations
    );
    stresses
}

#[test]
fn quadratic_elements_reach_the_limit_load_of_a_notched_strip() {
    for n in [2, 4, 8] {
        stresses(n, Order::Quadratic, 30);
    }
    for n in [4, 8] {
        stresses(n, Order::Linear, 30);
    }
}
