//! Cook's membrane of elastoplastic steel in plane strain: a benchmark of plasticity at finite strain.

use super::cook::panel;
use super::simo_steel::simo_steel;
use fem::{Axis, Conditions, End, Order, Problem, Schedule};

/// Deflection of the upper corner (mm) with n × n cells under the dead load of 5 kN per mm of thickness.
fn deflection(n: usize, order: Order, steps: u32) -> f64 {
    let conditions = Conditions::new()
        .fix("left", [Axis::X, Axis::Y])
        .fix("front", [Axis::Z])
        .fix("back", [Axis::Z])
        .traction("right", |_, time_s| [0.0, 5000.0 / 16.0 * time_s, 0.0]);
    let problem = Problem::builder(panel(n, 16.0 / n as f64))
        .order(order)
        .materials([simo_steel()])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, steps))
        .build()
        .expect("valid input");
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    let is_corner = |x: &[f64; 3]| (x[0] - 48.0).abs() + (x[1] - 60.0).abs() + x[2].abs() < 1e-9;
    let corner = problem.nodes().iter().position(is_corner).expect("a node at the corner");
    let deflection = outcome.fields.displacement[corner][1];
    println!(
        "{order:?}, {n} x {n} cells, {steps} steps: {deflection:.4} mm, {} iterations",
        outcome.effort.iterations
    );
    deflection
}

/// The published deflections of the finest meshes are 6.97 to 7.09 mm: Simo & Armero (Int. J. Numer. Meth. Engng 33
/// (1992) 1413), César de Sá, Areias & Natal Jorge (Int. J. Numer. Meth. Engng 51 (2001) 883), as collected by the
/// verification of solids4foam (tutorials/solids/elastoplasticity/cooksMembrane/verification). The independent program
/// `reference/plasticity_2d.py` gives 6.65, 6.74, 6.89 and 6.95 mm with 4², 8², 16² and 32² quadrilaterals of eight nodes:
/// a plastic hinge forms at the clamped upper corner, where stresses are singular, so that all meshes converge slowly.
///
/// Quadratic tetrahedra give 6.83 mm with 16² cells and 6.94 mm with 32² cells (50 s of processor time, not in this
/// test). Linear tetrahedra lock: 2.0 mm.
#[test]
fn the_elastoplastic_membrane_converges_to_its_published_deflection() {
    let quadratic = [4, 8, 16].map(|n| deflection(n, Order::Quadratic, 20));
    assert!(quadratic[0] < quadratic[1] && quadratic[1] < quadratic[2], "{quadratic:?}");
    assert!((quadratic[2] / 7.03 - 1.0).abs() < 0.03, "{quadratic:?}");
    assert!((quadratic[2] / 6.895 - 1.0).abs() < 0.0125, "{quadratic:?}");
    let locked = deflection(16, Order::Linear, 20);
    assert!(locked < 0.5 * quadratic[1], "{locked} and {quadratic:?}");
}
