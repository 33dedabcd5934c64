//! User-defined extensions: a law, a split, a degradation function and a law with a state, defined outside the crate.

mod own_degradation;
mod own_law;
mod own_split;
mod own_state;
#[path = "../support/test_device.rs"]
mod test_device;

use fem::{
    CompressionTest, ComputeDevice, CylinderLattice, LinearScheme, Material, Order, PhaseField,
    Schedule, SolverOptions, TetMesh, label,
};

/// Mesh of a cylinder of matrix, with grains if `grains` is true.
fn cylinder(grains: bool) -> TetMesh {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
    let mut mesh = lattice.build().expect("a mesh");
    if grains {
        let packing = fem::Packing::new(0.2, 1).fill(2.5, 4.4).expect("a packing");
        label(&mut mesh, &packing);
    }
    mesh
}

/// Settings of a run.
struct Run {
    order: Order,
    displacement_mm: f64,
    steps: u32,
    grains: bool,
    field: Option<PhaseField>,
}

impl Run {
    /// Returns the forces of a run, N. If a device is given, it solves the linear systems by multigrid.
    fn forces(&self, materials: &[Material], device: Option<ComputeDevice>) -> Vec<f64> {
        let linear = if device.is_some() { LinearScheme::Multigrid } else { LinearScheme::Auto };
        let options = SolverOptions { linear, tolerance: 1e-10, ..SolverOptions::default() };
        let schedule = Schedule::fixed(1.0, self.steps);
        let problem = CompressionTest::new(self.displacement_mm, schedule)
            .builder(cylinder(self.grains))
            .expect("a specimen")
            .order(self.order)
            .materials(materials.to_vec())
            .phase_field(self.field)
            .options(options)
            .device(device)
            .build()
            .expect("valid input");
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), self.steps as usize, "{:?}", outcome.end);
        outcome.curve.iter().map(|point| point.force_n).collect()
    }
}

#[track_caller]
fn assert_close(forces: &[f64], expected: &[f64], tolerance: f64) {
    let largest = expected.iter().fold(0.0f64, |most, f| most.max(f.abs()));
    assert!(largest > 0.0 && forces.len() == expected.len());
    for (a, b) in forces.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * largest, "{a} N instead of {b} N");
    }
}
