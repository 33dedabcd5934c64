//! What the runs of a surrogate cost: a hundred fracture tests of 20 000 linear tetrahedra, 44 steps
//! past the peak each.
//!
//! ```text
//! cargo run --release -p fem --example ensemble -- DIRECTORY [RUNS] [THREADS] [GRAIN_FRACTION]
//! ```
//!
//! The runs (default 100, on all processors, with a fifth of grains) spread evenly over E, ξ and Gc. They are
//! kept in the directory: stopped at any moment, the same command goes on. Printed as CSV
//! `quantity,value,unit` when all are there: what this call took, and the seconds of all runs together,
//! those of earlier calls too.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use fem::{
    CompressionTest, CylinderLattice, Ensemble, EnsembleProgress, Fracture, Material, Packing,
    PhaseField, RunInput, RunRecord, RunStatus, Schedule, SolverOptions, label,
};

struct Told;

impl EnsembleProgress for Told {
    fn ended(&self, record: &RunRecord) {
        eprintln!("run {} took {:.1} s: {:?}", record.id, record.seconds, record.status);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let directory =
        arguments.next().ok_or("usage: ensemble DIRECTORY [RUNS] [THREADS] [GRAIN_FRACTION]")?;
    let runs: usize = arguments.next().map_or(Ok(100), |a| a.parse())?;
    let threads: usize = arguments.next().map_or(Ok(0), |a| a.parse())?;
    let fraction: f64 = arguments.next().map_or(Ok(0.2), |a| a.parse())?;

    let (radius_mm, height_mm) = (2.5, 4.4);
    let mut mesh = CylinderLattice { radius_mm, height_mm, spacing_mm: 0.38 }.build()?;
    if fraction > 0.0 {
        label(&mut mesh, &Packing::new(fraction, 1).fill(radius_mm, height_mm)?);
    }
    let regions = mesh.regions.len();
    let materials = move |inputs: &[f64]| {
        let fracture = |toughness_n_per_mm| Fracture {
            toughness_n_per_mm,
            viscosity_mpa_s: inputs[1],
            residual_stiffness: 0.01,
        };
        let matrix = Material::hencky(inputs[0], 0.25).with_fracture(fracture(inputs[2]));
        let grain = Material::hencky(22_000.0, 0.25).with_fracture(fracture(3.5));
        [matrix, grain][..regions].to_vec()
    };
    let loading = CompressionTest::new(0.22, Schedule::fixed(1.0, 44));
    let baseline = materials(&[275.0, 0.3, 0.0025]);
    let (field, options) = (PhaseField::new(0.06), SolverOptions::default());
    let test =
        loading.builder(mesh)?.materials(baseline).phase_field(field).options(options).build()?;

    // the additive recurrence of the root of x⁴ = x + 1 fills a cube evenly
    let root: f64 = 1.220_744_084_605_759_5;
    let inputs: Vec<RunInput> = (0..runs)
        .map(|id| {
            let at = |k: i32, low: f64, high: f64| {
                low + (high - low) * (0.5 + (id + 1) as f64 * root.powi(-k)).fract()
            };
            RunInput { id, inputs: vec![at(1, 200.0, 350.0), at(2, 0.2, 0.4), at(3, 1e-3, 4e-3)] }
        })
        .collect();
    let fingerprint = format!(
        "specimen = cylinder of {} tetrahedra\nsteps = 44\ngrain fraction = {fraction}",
        test.mesh().tets.len()
    );
    let ensemble = Ensemble::open(directory, &fingerprint)?;
    let clock = Instant::now();
    let records = ensemble.run(
        &inputs,
        &["young_mpa", "viscosity_mpa_s", "toughness_n_per_mm"],
        threads,
        &|run, _| Ok(test.with_materials(materials(&run.inputs))?.run(&mut ())),
        &Told,
        &AtomicBool::new(false),
    )?;
    println!("quantity,value,unit");
    println!("tetrahedra,{},1", test.mesh().tets.len());
    println!("unknowns,{},1", test.unknowns());
    println!("runs,{},1", records.len());
    let whole = records.iter().filter(|r| r.status == RunStatus::Finished && r.curve.len() == 44);
    println!("runs_of_44_steps,{},1", whole.count());
    println!("this_call,{:.1},s", clock.elapsed().as_secs_f64());
    println!(
        "all_runs_one_after_the_other,{:.1},s",
        records.iter().map(|r| r.seconds).sum::<f64>()
    );
    Ok(())
}
