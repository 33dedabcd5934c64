//! Volumetric locking in the plastic range: the limit load of a deeply notched strip in plane strain.

use crate::support::block::{block, even, graded};
use fem::{Axis, Conditions, End, Material, Order, Plasticity, Problem, Schedule};

const YOUNG_MPA: f64 = 200_000.0;
const YIELD_MPA: f64 = 0.2;
/// Half the width of the strip and half its height, mm; half the width of the ligament is 1 mm.
const WIDTH_MM: f64 = 10.0;
const HEIGHT_MM: f64 = 15.0;

const STEPS: u32 = 36;

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
    let end_mm = 144.0 * YIELD_MPA / YOUNG_MPA;
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

/// The limit load of a deep notch equals the limit load of Prandtl's punch: (2 + π)/√3 = 2.97 times the yield stress on the ligament.
/// Elements that lock have no limit load (Nagtegaal, Parks & Rice, Comput. Methods Appl. Mech. Engrg. 4 (1974) 153).
#[test]
fn quadratic_elements_reach_the_limit_load_of_a_notched_strip() {
    let exact = (2.0 + std::f64::consts::PI) / 3f64.sqrt();
    // error of the last stress, and its increase over the last sixth of the path
    let measure = |n, order| {
        let stresses = stresses(n, order, STEPS);
        let [before, last] = [5 * STEPS / 6, STEPS].map(|step| stresses[step as usize - 1]);
        println!(
            "{order:?} {n}: {:.4} of the limit load, rise {:.4}",
            last / exact,
            last / before - 1.0
        );
        [last / exact - 1.0, last / before - 1.0]
    };
    let [coarse, fine] = [4, 8].map(|n| measure(n, Order::Quadratic));
    assert!(coarse[1] < 0.005 && fine[1] < 0.002, "no plateau: {coarse:?} {fine:?}");
    assert!(fine[0] > 0.0 && fine[0] < 0.04, "{coarse:?} {fine:?}");
    // the error is proportional to the size of the cells
    assert!((2.0 * fine[0] - coarse[0]).abs() < 0.01, "{coarse:?} {fine:?}");
    let linear = measure(8, Order::Linear);
    assert!(linear[0] > 0.2 && linear[1] > 0.02, "{linear:?}");
}
