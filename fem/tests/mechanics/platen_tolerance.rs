//! Unilateral platens at different tolerances of the solver.

use crate::support::block::{block, even};
use crate::support::{HEIGHT, RADIUS, between, loading, matrix, test};
use fem::{
    Axis, Conditions, CrackDensity, CylinderLattice, End, Friction, Material, Order, Outcome,
    PhaseField, Platen, Platens, Problem, Schedule, SolverOptions, TetMesh,
};

fn cylinder(grains: bool) -> TetMesh {
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm: 0.7 };
    let mut mesh = lattice.build().expect("a mesh");
    if grains {
        let grains = fem::Packing::new(0.15, 3).fill(RADIUS, HEIGHT).expect("a packing");
        fem::label(&mut mesh, &grains);
    }
    mesh
}

fn pressed(grains: bool, coefficient: f64, tolerance: f64, field: Option<PhaseField>) -> Outcome {
    let mesh = cylinder(grains);
    let solids = [Material::hencky(22_000.0, 0.25)];
    let solids: Vec<Material> =
        std::iter::once(matrix()).chain(solids).take(mesh.regions.len()).collect();
    let way = loading(0.05, 0.25, 2);
    let test = test(mesh, Order::Linear, solids, field, way.clone(), tolerance);
    let friction = Friction { coefficient, slip_velocity_mm_per_s: 1e-3, drag_mpa_s_per_mm: 0.0 };
    between(&test, &way, Platens::Unilateral(friction)).run(&mut ())
}

/// Compresses a flat slab between two plane platens.
fn slab(tolerance: f64, field: Option<PhaseField>) -> Outcome {
    let mesh = block([&even(0.0, 10.0, 10), &even(0.0, 10.0, 10), &even(0.0, 2.0, 2)]);
    let plane = |level: f64, up: f64| Platen::plane([0.0, 0.0, level], [0.0, 0.0, up]);
    let conditions = Conditions::new()
        .platen("bottom", plane(0.0, 1.0))
        .platen("top", plane(2.0, -1.0).moving(|t| [0.0, 0.0, -0.02 * t]))
        .fix("left", [Axis::X])
        .fix("front", [Axis::Y])
        .measure("top", [0.0, 0.0, -1.0]);
    let problem = Problem::builder(mesh)
        .materials([matrix()])
        .phase_field(field)
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 2))
        .options(SolverOptions { tolerance, ..SolverOptions::default() })
        .build()
        .expect("valid");
    problem.run(&mut ())
}

#[test]
fn platens_work_at_every_tolerance() {
    for (grains, coefficient) in [(false, 0.0), (true, 0.0), (false, 0.2)] {
        let mut forces = Vec::new();
        for tolerance in [1e-10, 1e-8, 1e-6, 1e-4] {
            let outcome = pressed(grains, coefficient, tolerance, None);
            let case = format!("{grains} {coefficient} {tolerance:e}: {:?}", outcome.effort);
            assert!(matches!(outcome.end, End::Displacement), "{case}: {:?}", outcome.end);
            // with friction, the first step needs more iterations, because the slip velocity is reduced gradually
            let most = if coefficient > 0.0 { 60 } else { 30 };
            assert!(outcome.effort.cuts == 0 && outcome.effort.iterations < most, "{case}");
            forces.push(outcome.curve[1].force_n);
            let off = (outcome.curve[1].force_n / forces[0] - 1.0).abs();
            assert!(off < 10.0 * tolerance, "{case}: {off:e}");
        }
    }
}

#[test]
fn a_flat_slab_needs_few_iterations_with_and_without_damage() {
    let at1 = PhaseField { model: CrackDensity::At1, ..PhaseField::new(0.06) };
    // with a small length ℓ₀, the strength is so high that no damage occurs
    let tough = PhaseField { length_mm: 1e-4, ..at1 };
    for tolerance in [1e-10, 1e-8, 1e-6, 1e-4] {
        let [elastic, sound, breaks] = [None, Some(tough), Some(at1)].map(|field| {
            let outcome = slab(tolerance, field);
            let case = format!("{field:?} {tolerance:e}: {:?}", outcome.effort);
            assert!(matches!(outcome.end, End::Displacement), "{case}: {:?}", outcome.end);
            assert!(outcome.effort.cuts == 0 && outcome.effort.iterations < 30, "{case}");
            *outcome.curve.last().expect("a curve")
        });
        assert!((sound.force_n / elastic.force_n - 1.0).abs() < 10.0 * tolerance);
        assert!(sound.phi_max == 0.0 && breaks.phi_max > 0.0, "{sound:?} {breaks:?}");
    }
}
