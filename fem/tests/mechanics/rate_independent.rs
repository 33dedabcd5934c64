//! Damage without viscosity beyond the peak force.

use crate::support::{HEIGHT, RADIUS};
use fem::{
    CompressionTest, CylinderLattice, End, Fracture, Material, Outcome, PhaseField, Schedule,
    SolverOptions, Split, TetMesh,
};

fn packing(spacing_mm: f64) -> TetMesh {
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm };
    let mut mesh = lattice.build().expect("a mesh");
    let grains = fem::Packing::new(0.2, 1).fill(RADIUS, HEIGHT).expect("a packing");
    fem::label(&mut mesh, &grains);
    mesh
}

fn run(mesh: TetMesh, field: PhaseField, residual_stiffness: f64, steps: u32) -> Outcome {
    let matrix = Material::hencky(275.0, 0.25)
        .with_fracture(Fracture { residual_stiffness, ..Fracture::new(0.0025) });
    let mut schedule = Schedule::fixed(1.0, steps);
    schedule.stop_below_peak = Some(0.3);
    let problem = CompressionTest::new(0.22, schedule)
        .builder(mesh)
        .and_then(|builder| {
            builder
                .materials([matrix, Material::hencky(22_000.0, 0.25)])
                .phase_field(field)
                .options(SolverOptions::default())
                .build()
        })
        .expect("valid");
    problem.run(&mut ())
}

/// A packing with 20 % of grains and a residual stiffness of 1e-4, in 44 steps. Damage grows unstably beyond the peak.
/// With the spectral split, closed cracks carry load, and the force rises until the end.
#[test]
fn a_packing_without_viscosity_completes_its_run_with_each_split() {
    for (split, falls) in
        [(Split::None, true), (Split::VolumetricDeviatoric, true), (Split::Spectral, false)]
    {
        let field = PhaseField { split, ..PhaseField::new(0.06) };
        let outcome = run(packing(0.7), field, 1e-4, 44);
        match (falls, &outcome.end) {
            (true, End::BelowPeak) | (false, End::Displacement) => {}
            (_, end) => panic!("{split:?}: {end:?} after {} points", outcome.curve.len()),
        }
        assert!(outcome.effort.fallbacks > 0, "{split:?}: {:?}", outcome.effort);
        let last = outcome.curve.last().expect("points");
        assert!(last.residual <= 1e-8, "{split:?}: {last:?}");
    }
}
