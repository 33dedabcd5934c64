//! Damage without viscosity past the peak.

use crate::support::{HEIGHT, RADIUS};
use fem::{
    CompressionTest, CrackDensity, CylinderLattice, End, Fracture, Irreversibility, Material,
    Order, Outcome, PhaseField, Schedule, SolverOptions, Split, TetMesh,
};

fn packing(spacing_mm: f64) -> TetMesh {
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm };
    let mut mesh = lattice.build().expect("a mesh");
    let grains = fem::Packing::new(0.2, 1).fill(RADIUS, HEIGHT).expect("a packing");
    fem::label(&mut mesh, &grains);
    mesh
}

fn run(
    mesh: TetMesh,
    order: Order,
    field: PhaseField,
    residual_stiffness: f64,
    steps: u32,
) -> Outcome {
    let matrix = Material::hencky(275.0, 0.25)
        .with_fracture(Fracture { residual_stiffness, ..Fracture::new(0.0025) });
    let mut schedule = Schedule::fixed(1.0, steps);
    schedule.stop_below_peak = Some(0.3);
    let problem = CompressionTest::new(0.22, schedule)
        .builder(mesh)
        .and_then(|builder| {
            builder
                .order(order)
                .materials([matrix, Material::hencky(22_000.0, 0.25)])
                .phase_field(field)
                .options(SolverOptions::default())
                .build()
        })
        .expect("valid");
    problem.run(&mut ())
}

#[test]
#[ignore = "a table"]
fn table() {
    let only = std::env::var("CASE").unwrap_or_default();
    for split in [Split::None, Split::VolumetricDeviatoric, Split::Spectral] {
        for residual in [0.01, 1e-4, 0.0] {
            let case = format!("{split:?} {residual:e}");
            if !case.starts_with(&only) {
                continue;
            }
            let start = std::time::Instant::now();
            let field = PhaseField { split, ..PhaseField::new(0.06) };
            let outcome = run(packing(0.7), Order::Linear, field, residual, 44);
            let forces: Vec<String> =
                outcome.curve.iter().map(|p| format!("{:.1}", p.force_n)).collect();
            let end = match &outcome.end {
                End::Failed(e) => e.to_string(),
                end => format!("{end:?}"),
            };
            println!(
                "{case}: {} {:?} {end} {:.1} s",
                forces.join(" "),
                outcome.effort,
                start.elapsed().as_secs_f64()
            );
        }
    }
    let _ = (CrackDensity::At1, Irreversibility::None);
}
