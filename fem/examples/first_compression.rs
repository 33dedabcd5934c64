//! Compresses a cylinder of grains in a softer matrix until it breaks, and prints the force–displacement curve.
//!
//! ```text
//!        ↓ ↓ ↓ ↓ ↓   upper platen moves down, 0.22 mm/s
//!       ┌─────────┐
//!       │ ○  ○  ○ │
//!       │  ○  ○   │  height 4.4 mm, diameter 5 mm
//!       │ ○  ○  ○ │  ○ grain, 20 % of the volume
//!       │  ○   ○  │
//!       └─────────┘  lower platen rests
//! ```
//!
//! ```text
//! cargo run --release -p fem --example first_compression
//! ```
//!
//! Expected output (the last digits depend on the processor):
//! ```text
//! 3040 elements, grain fraction 0.205
//! displacement_mm,force_N,largest_damage
//! 0.0022,6.10,0.000
//! 0.0055,15.27,0.000
//! 0.0105,29.08,0.002
//! …
//! 0.1095,234.19,0.822
//! 0.1150,235.62,0.877
//! 0.1205,235.17,0.922
//! …
//! 0.1700,211.03,0.999
//! peak 235.6 N; the run ended with BelowPeak
//! ```
//! `first_compression.vtu`, in the folder for temporary files, shows displacement, damage and stress in ParaView.

use fem::{
    CompressionTest, CylinderLattice, Fracture, Material, Packing, PhaseField, Schedule, label,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // mesh: a cylinder whose elements are assigned to matrix or grain
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
    let mut mesh = lattice.build()?;
    let grains = Packing::new(0.2, 1).fill(lattice.radius_mm, lattice.height_mm)?;
    let report = label(&mut mesh, &grains);
    println!("{} elements, grain fraction {:.3}", mesh.tets.len(), report.achieved_fraction);

    // materials, in the order of the regions of the mesh: matrix, grain
    let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    });
    let grain = Material::hencky(22_000.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 1.83,
        viscosity_mpa_s: 0.1,
        residual_stiffness: 0.01,
    });

    // test: 0.22 mm in 1 s; the run stops when the force is 10 % below its peak
    let problem = CompressionTest::new(0.22, Schedule::adaptive(1.0).stop_below_peak(0.1))
        .builder(mesh)?
        .materials([matrix, grain])
        .phase_field(PhaseField::new(0.06))
        .build()?;
    for warning in problem.warnings() {
        println!("warning: {warning}");
    }

    println!("displacement_mm,force_N,largest_damage");
    let mut run = problem.start();
    while let Some(point) = run.step() {
        println!("{:.4},{:.2},{:.3}", point.displacement_mm, point.force_n, point.phi_max);
    }
    let outcome = run.finish();
    let peak = outcome.curve.iter().map(|point| point.force_n).fold(0.0, f64::max);
    println!("peak {peak:.1} N; the run ended with {:?}", outcome.end);
    problem.write_vtu(std::env::temp_dir().join("first_compression.vtu"), &outcome.fields)?;
    Ok(())
}
