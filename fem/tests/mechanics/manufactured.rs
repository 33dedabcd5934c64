//! Convergence to manufactured solutions, in space and in time.

use crate::support::block::{block, even};
use crate::support::manufactured::{errors, order};
use fem::{
    Axis, Conditions, DamageQuadrature, Fracture, Material, Order, PhaseField, Problem, Schedule,
    SolverOptions,
};

/// Checks that the orders of convergence, computed from the last two of four meshes, are close to the theoretical orders.
fn check(element: Order, cells: [usize; 4], damaged: bool, expected: [f64; 2]) {
    let mesh_errors: Vec<_> = cells.iter().map(|&n| errors(n, element, damaged)).collect();
    let ratio = cells[3] as f64 / cells[2] as f64;
    type Norms = fn(&crate::support::manufactured::Errors) -> [f64; 2];
    let fields: [(&str, Norms); 2] = [("u", |e| e.displacement), ("φ", |e| e.damage)];
    for (name, errors) in &fields[..if damaged { 2 } else { 1 }] {
        for (k, norm) in ["L²", "H¹"].iter().enumerate() {
            let series: Vec<f64> = mesh_errors.iter().map(|e| errors(e)[k]).collect();
            assert!(series.windows(2).all(|w| w[1] < w[0]), "{name} in {norm}: {series:?}");
            let observed = order(series[2], series[3], ratio);
            assert!(
                (observed - expected[k]).abs() < 0.25,
                "{element:?}, {name} in {norm}: order {observed} of {series:?}"
            );
        }
    }
}

#[test]
fn finite_strain_elasticity_converges_at_the_optimal_orders() {
    check(Order::Linear, [2, 4, 6, 8], false, [2.0, 1.0]);
    check(Order::Quadratic, [1, 2, 3, 4], false, [3.0, 2.0]);
}

#[test]
fn damage_and_displacement_converge_together() {
    check(Order::Linear, [2, 4, 6, 8], true, [2.0, 1.0]);
    check(Order::Quadratic, [1, 2, 3, 4], true, [3.0, 2.0]);
}

#[test]
fn the_error_in_time_is_of_first_order() {
    // φ = 0.4 t² with the matching source, without deformation: the fields are uniform in space, so that only the time
    // integration has an error
    let (toughness, length, viscosity) = (2.0, 0.5, 3.0);
    let exact = |t: f64| 0.4 * t * t;
    let material = Material::hencky(10.0, 0.3)
        .with_fracture(Fracture { viscosity_mpa_s: viscosity, ..Fracture::new(toughness) });
    let field = PhaseField { quadrature: DamageQuadrature::Consistent, ..PhaseField::new(length) };
    let ends = even(0.0, 1.0, 1);
    let error = |steps: u32| {
        let faces = ["left", "right", "front", "back", "bottom", "top"];
        let conditions = faces
            .iter()
            .fold(Conditions::new(), |c, face| c.fix(face, Axis::ALL))
            .damage_source(move |_, t| toughness / length * exact(t) + viscosity * 0.8 * t);
        let problem = Problem::builder(block([&ends, &ends, &ends]))
            .materials([material.clone()])
            .phase_field(field)
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, steps))
            .options(SolverOptions { tolerance: 1e-12, ..SolverOptions::default() })
            .build()
            .expect("valid input");
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), steps as usize, "{:?}", outcome.end);
        (outcome.curve[steps as usize - 1].phi_mean - exact(1.0)).abs()
    };
    let errors = [8, 16, 32, 64].map(error);
    for pair in errors.windows(2) {
        let observed = order(pair[0], pair[1], 2.0);
        assert!((observed - 1.0).abs() < 0.06, "order {observed} of {errors:?}");
    }
}
