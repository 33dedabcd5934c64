//! What the engine costs: CSV lines `quantity,value,unit`, one thread.
//!
//! Run: `cargo bench -p fem --bench engine`. The specimen is a lattice cylinder of about three
//! thousand tetrahedra, as in the main job; the figures are the best of a few repetitions.

use std::time::Instant;

use fem::{
    CompressionTest, CylinderLattice, ElasticLaw, Loading, Material, Order, PhaseField,
    SolverOptions, Stepping,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 }.build()?;
    let tets = mesh.tets.len();
    let matrix = Material {
        law: ElasticLaw::Hencky,
        young_mpa: 275.0,
        poisson: 0.25,
        toughness_n_per_mm: Some(0.0025),
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    };
    let field = PhaseField::new(0.06);
    let loading = Loading {
        displacement_mm: 0.22,
        duration_s: 1.0,
        stepping: Stepping::Fixed(44),
        stop_below_peak: Some(0.1),
    };
    println!("quantity,value,unit");
    println!("tetrahedra,{tets},1");
    let begin = Instant::now();
    let test = CompressionTest::new(
        mesh,
        Order::Linear,
        vec![matrix],
        Some(field),
        loading,
        SolverOptions::default(),
    )?;
    println!("setup,{:.1},ms", 1e3 * begin.elapsed().as_secs_f64());
    println!("unknowns,{},1", test.unknowns());
    println!("factor_entries,{},1", test.factor_entries());
    let parts = test.time_parts(5)?;
    println!("residual,{:.3},us/tet", 1e6 * parts.residual_s / tets as f64);
    println!("tangent,{:.3},us/tet", 1e6 * parts.tangent_s / tets as f64);
    println!("factorisation,{:.2},ms", 1e3 * parts.factorisation_s);
    println!("solve,{:.2},ms", 1e3 * parts.solve_s);
    println!("newton_iteration,{:.2},ms", 1e3 * parts.newton_iteration_s());
    let begin = Instant::now();
    let outcome = test.run(&mut ());
    println!("run,{:.3},s", begin.elapsed().as_secs_f64());
    println!("run_steps,{},1", outcome.curve.len());
    println!("run_iterations,{},1", outcome.effort.iterations);
    println!("run_factorisations,{},1", outcome.effort.factorisations);
    Ok(())
}
