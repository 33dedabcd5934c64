//! Compression without viscosity, until the force is 30 % below its peak: for which splits and residual stiffnesses a
//! run completes, and its cost.
//!
//! ```text
//! cargo bench -p fem --bench rate_independent -- [ROW ...]
//! ```
//!
//! A row is a mesh, a split and a residual stiffness, such as `coarse,none,0.01`. Meshes are
//! - `coarse`: cylinder of linear elements, spacing 0.7 mm, a fifth of grains;
//! - `default`: cylinder of the default case, quadratic elements, spacing 0.42 mm, a fifth of grains as mixtures;
//! - a spacing in mm: the mesh `default` with this spacing.
//!
//! Splits are `none`, `volumetric-deviatoric` and `spectral`. Without rows, all splits run on both meshes with residual
//! stiffness 0.01 and 1e-4. Printed as CSV: the row, the reason of the end, load steps, peak force and displacement at
//! peak, force at the end, largest residual of a step, Newton iterations, iterations of the linear solver, increments
//! that a slower scheme solved, and processor seconds. `PROGRESS=1` prints every load step to the standard error
//! output.

use std::error::Error;
use std::fs;

use fem::{
    CompressionTest, CylinderLattice, Fracture, GrainList, GrainMode, Homogenisation, Material,
    Meshing, Order, Packing, PhaseField, Problem, Schedule, Split,
};

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
const DEFAULT_SPACING_MM: f64 = 0.42;
const HEADER: &str = "mesh,split,residual_stiffness,end,steps,peak_N,peak_mm,end_N,residual,newton,linear,rescued,seconds";

fn main() -> Result<(), Box<dyn Error>> {
    let mut rows: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    if rows.is_empty() {
        for mesh in ["coarse", "default"] {
            for split in ["none", "volumetric-deviatoric", "spectral"] {
                rows.extend(
                    ["0.01", "1e-4"].map(|stiffness| format!("{mesh},{split},{stiffness}")),
                );
            }
        }
    }
    println!("{HEADER}");
    for row in rows {
        println!("{row},{}", run(&row)?);
    }
    Ok(())
}

/// Runs a row and returns its results as CSV.
fn run(row: &str) -> Result<String, Box<dyn Error>> {
    let fields: Vec<&str> = row.split(',').collect();
    let &[mesh, split, stiffness] = fields.as_slice() else {
        return Err(format!("{row}: give MESH,SPLIT,RESIDUAL_STIFFNESS").into());
    };
    let split: Split = serde_json::from_value(split.into())?;
    let problem = problem(mesh, split, stiffness.parse()?)?;
    let begin = processor_seconds();
    let mut stepper = problem.start();
    let is_shown = std::env::var_os("PROGRESS").is_some();
    while let Some(point) = stepper.step() {
        if is_shown {
            let seconds = processor_seconds() - begin;
            eprintln!(
                "{:.4} mm {:.3} N {:?} {seconds:.1} s",
                point.displacement_mm,
                point.force_n,
                stepper.effort()
            );
        }
    }
    let outcome = stepper.finish();
    let seconds = processor_seconds() - begin;
    let end = format!("{:?}", outcome.end).replace([',', '\n'], ";");
    let peak =
        outcome.curve.iter().max_by(|a, b| a.force_n.total_cmp(&b.force_n)).ok_or(end.clone())?;
    let last = outcome.curve.last().ok_or("no step")?;
    let residual = outcome.curve.iter().map(|point| point.residual).fold(0.0, f64::max);
    let effort = outcome.effort;
    Ok(format!(
        "{end},{},{:.2},{:.4},{:.2},{residual:.1e},{},{},{},{seconds:.1}",
        outcome.curve.len(),
        peak.force_n,
        peak.displacement_mm,
        last.force_n,
        effort.iterations,
        effort.linear,
        effort.fallbacks,
    ))
}

fn problem(mesh: &str, split: Split, residual_stiffness: f64) -> Result<Problem, Box<dyn Error>> {
    let film_mm = if mesh == "coarse" { Packing::new(0.2, 1).film_mm } else { 0.2 };
    let grains = Packing { film_mm, ..Packing::new(0.2, 1) }.fill(RADIUS_MM, HEIGHT_MM)?;
    let (mesh, order) = if mesh == "coarse" {
        let lattice =
            CylinderLattice { radius_mm: RADIUS_MM, height_mm: HEIGHT_MM, spacing_mm: 0.7 };
        let mut mesh = lattice.build()?;
        fem::label(&mut mesh, &grains);
        (mesh, Order::Linear)
    } else {
        let spacing = if mesh == "default" { DEFAULT_SPACING_MM } else { mesh.parse()? };
        let meshing = Meshing { mode: GrainMode::Fraction, curved: true, ..Meshing::new(spacing) };
        let grains = GrainList::new(grains, RADIUS_MM, HEIGHT_MM);
        (meshing.build(RADIUS_MM, HEIGHT_MM, &grains)?.mesh, Order::Quadratic)
    };
    let matrix = Material::hencky(275.0, 0.25)
        .with_fracture(Fracture { residual_stiffness, ..Fracture::new(0.0025) });
    let schedule = Schedule::fixed(1.0, 44).stop_below_peak(0.3);
    let builder = CompressionTest::new(0.22, schedule).builder(mesh)?;
    Ok(builder
        .order(order)
        .materials([matrix, Material::hencky(22_000.0, 0.25)])
        .homogenisation(Homogenisation::GeometricMean)
        .phase_field(PhaseField { split, ..PhaseField::new(0.06) })
        .build()?)
}

/// Processor time of this process, s; NaN where Linux does not report it.
fn processor_seconds() -> f64 {
    let tasks = fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let times = tasks.filter_map(|task| {
        let text = fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    times.reduce(|a, b| a + b).map_or(f64::NAN, |nanoseconds| 1e-9 * nanoseconds)
}
