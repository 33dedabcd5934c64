//! Platens that a body may leave, at every tolerance of the solver.

use crate::support::block::{block, even};
use crate::support::{HEIGHT, RADIUS, between, loading, matrix, phase_field, test};
use fem::{
    Axis, Conditions, CrackDensity, CylinderLattice, End, Friction, Material, Order, Outcome,
    PhaseField, Platen, Platens, Problem, Schedule, SolverOptions, Split, TetMesh,
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

/// A flat slab on one plane, pressed by another.
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
fn report() {
    let at1 = PhaseField { model: CrackDensity::At1, ..PhaseField::new(0.06) };
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12] {
        for grains in [false, true] {
            for friction in [0.0, 0.2] {
                let outcome = pressed(grains, friction, tolerance, None);
                let force = outcome.curve.last().map_or(0.0, |p| p.force_n);
                let failed = match &outcome.end {
                    End::Failed(e) => e.to_string(),
                    _ => String::new(),
                };
                println!(
                    "{tolerance:e} {grains} {friction}: {force} {:?} {failed}",
                    outcome.effort
                );
            }
        }
        for field in [None, Some(at1), Some(phase_field(Split::None))] {
            let outcome = slab(tolerance, field);
            let force = outcome.curve.last().map_or(0.0, |p| p.force_n);
            let failed = match &outcome.end {
                End::Failed(e) => e.to_string(),
                _ => String::new(),
            };
            println!(
                "{tolerance:e} slab {:?}: {force} {:?} {failed}",
                field.map(|f| f.model),
                outcome.effort
            );
        }
    }
}
