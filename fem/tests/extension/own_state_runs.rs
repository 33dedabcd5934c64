//! State of a user-defined law on a device, over a checkpoint and on curved elements, against the closed form.

use fem::{
    Axis, Block, Checkpoint, Conditions, CylinderLattice, LinearScheme, Material, Order, Problem,
    Schedule, SolverOptions, TetMesh, Wall,
};

use super::own_state::{BODY, HELD, STEPS, held, relaxed_stress};
use super::test_device::test_device;

/// Problem in which the whole surface has a uniform strain along the axis: it is compressed in the first increment and
/// held.
fn held_everywhere(
    mesh: TetMesh,
    surfaces: &[&str],
    linear: LinearScheme,
    device: Option<fem::ComputeDevice>,
) -> Problem {
    let moved = |x: [f64; 3], time_s: f64| {
        [0.0, 0.0, if time_s > 0.0 { HELD.exp_m1() * x[2] } else { 0.0 }]
    };
    // the ends alone are moved along the axis: the force on an edge belongs to one surface, the end
    let conditions = surfaces.iter().fold(Conditions::new(), |conditions, &surface| {
        let is_end = surface == "bottom" || surface == "top";
        let axes = if is_end { &Axis::ALL[..] } else { &[Axis::X, Axis::Y] };
        conditions.prescribe(surface, axes.iter().copied(), moved)
    });
    let options = SolverOptions { linear, tolerance: 1e-10, ..SolverOptions::default() };
    Problem::builder(mesh)
        .order(Order::Quadratic)
        .materials([Material::with_law(BODY).expect("a law")])
        .conditions(conditions.measure("top", [0.0, 0.0, 1.0]))
        .options(options)
        .device(device)
        .schedule(Schedule::fixed(1.0, STEPS as u32))
        .build()
        .expect("valid input")
}

/// Asserts that the force per area of the top follows the closed form τ/λ.
#[track_caller]
fn assert_relaxes(points: &[fem::CurvePoint], area_mm2: f64) {
    assert_eq!(points.len(), STEPS);
    for point in points {
        let exact = relaxed_stress(point.time_s) / HELD.exp() * area_mm2;
        assert!((point.force_n / exact - 1.0).abs() < 1e-7, "{point:?} instead of {exact} N");
    }
}

#[test]
fn the_state_evolves_on_a_device() {
    let Some(device) = test_device() else { return };
    let mesh = Block::new([1.0; 3], [3; 3]).build().expect("a mesh");
    let surfaces = ["left", "right", "front", "back", "bottom", "top"];
    let name = device.name().to_owned();
    let problem = held_everywhere(mesh, &surfaces, LinearScheme::Multigrid, Some(device));
    let mut run = problem.start();
    while run.step().is_some() {
        // the name contains more words if the processor had to compute residuals or linear systems
        assert_eq!(run.machine(), name);
    }
    assert_relaxes(&run.finish().curve, 1.0);
}

/// The run is interrupted in the middle of the relaxation. Without the saved state, the body would relax once more.
#[test]
fn the_state_is_resumed_from_a_checkpoint() {
    let folder = tempfile::tempdir().expect("a folder");
    for order in [Order::Linear, Order::Quadratic] {
        let path = folder.path().join(format!("{order:?}"));
        let checkpoint = Checkpoint { path, every: 2 };
        let problem = held(order);
        let mut run = problem.resume(&checkpoint).expect("nothing is there yet");
        for _ in 0..4 {
            run.step().expect("it converges");
        }
        drop(run);
        let mut run = problem.resume(&checkpoint).expect("a state of the same problem");
        assert_eq!(run.curve().len(), 4);
        while run.step().is_some() {}
        assert_relaxes(&run.finish().curve, 1.0);
    }
}

#[test]
fn the_state_evolves_in_curved_elements() {
    let lattice = CylinderLattice { radius_mm: 1.0, height_mm: 1.0, spacing_mm: 0.5 };
    let mesh = lattice.build_with(Wall::Curved).expect("a lattice");
    assert!(!mesh.edge_points.is_empty(), "the wall is curved");
    let problem = held_everywhere(mesh, &["bottom", "top", "side"], LinearScheme::Auto, None);
    let outcome = problem.run(&mut ());
    // curved edges are parabolas: the area of the top differs from that of a circle
    let area_mm2 = outcome.curve[0].force_n * HELD.exp() / relaxed_stress(outcome.curve[0].time_s);
    assert!((area_mm2 / std::f64::consts::PI - 1.0).abs() < 5e-3, "{area_mm2}");
    assert_relaxes(&outcome.curve, area_mm2);
    let exact = relaxed_stress(1.0) / HELD.exp();
    let state = problem.evaluate(&outcome.fields).expect("the fields of the problem");
    for element in state.elements().expect("no element is inverted") {
        let stress = element.stress_mpa[2];
        assert!((stress / exact - 1.0).abs() < 1e-7, "{stress} instead of {exact} MPa");
    }
}
