//! How far a workstation comes with the mesh of the method paper: a cylinder of quadratic
//! tetrahedra with thousands of grains, 12.3 million unknowns.
//!
//! ```text
//! cargo run --release -p fem --example paper_scale -- [SHARE] [STEPS]
//! ```
//!
//! `SHARE` is the share of the 2.3 million tetrahedra (default 0.125), `STEPS` the load steps to
//! take (default 2) of the 88 equal ones to 0.22 mm. Printed as CSV `quantity,value,unit`: set-up,
//! seconds and iterations of every step, memory, and an estimate for the steps to the peak, which
//! this material reaches at about 0.125 mm.
//!
//! Measured on two shared cores: share 0.125 (314 400 tetrahedra, 1.73 million unknowns, 834 grains)
//! took 13 processor seconds and 8.3 linear iterations a Newton iteration, and 1.8 GB at most. Share 1
//! (2.39 million tetrahedra, 12.98 million unknowns, 6404 grains), at low priority beside other work:
//! 331 s to set up, half of them for the labels, then a first load step of 14 Newton iterations with
//! 8.6 linear ones and 91 s each, and 10.6 GB at most. At that rate the 50 steps to the peak take some
//! 18 hours.

use std::ops::ControlFlow;
use std::time::Instant;

use fem::{
    CompressionTest, CurvePoint, CylinderLattice, ElasticLaw, Fields, Loading, Material, Order,
    Packing, PhaseField, SizeClass, SolverOptions, Stepping, label,
};

const TETRAHEDRA: f64 = 2.3e6;
const STEPS: u32 = 88;
const DISPLACEMENT_MM: f64 = 0.22;
/// Where the paper's baseline has its peak.
const PEAK_MM: f64 = 0.123;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let share: f64 = arguments.next().map_or(Ok(0.125), |a| a.parse())?;
    let steps: usize = arguments.next().map_or(Ok(2), |a| a.parse())?;
    println!("quantity,value,unit");

    let clock = Instant::now();
    let (radius_mm, height_mm) = (2.5, 4.4);
    let volume = std::f64::consts::PI * radius_mm * radius_mm * height_mm;
    // twelve tetrahedra to a cell of the lattice
    let spacing_mm = (12.0 * volume / (share * TETRAHEDRA)).cbrt();
    let mut mesh = CylinderLattice { radius_mm, height_mm, spacing_mm }.build()?;
    // grains as many elements across as in the paper, 2.2
    let grains = Packing {
        sizes: vec![SizeClass { median_radius_mm: 1.1 * spacing_mm, spread: 0.2, share: 1.0 }],
        film_mm: 0.1 * spacing_mm,
        ..Packing::new(0.22, 1)
    };
    let grains = grains.fill(radius_mm, height_mm)?;
    line("grains", grains.len() as f64, "1");
    line("packing", clock.elapsed().as_secs_f64(), "s");
    let report = label(&mut mesh, &grains);
    line("grain_fraction", report.achieved_fraction, "1");
    line("mesh_and_labels", clock.elapsed().as_secs_f64(), "s");
    line("tetrahedra", mesh.tets.len() as f64, "1");

    let matrix = Material {
        toughness_n_per_mm: Some(0.0025),
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
        ..Material::elastic(ElasticLaw::Hencky, 275.0, 0.25)
    };
    let grain = Material {
        toughness_n_per_mm: Some(3.5),
        ..Material { young_mpa: 22_000.0, ..matrix.clone() }
    };
    let loading = Loading {
        displacement_mm: DISPLACEMENT_MM,
        duration_s: 1.0,
        stepping: Stepping::Fixed(STEPS),
        stop_below_peak: None,
    };
    let options = SolverOptions { tolerance: 1e-5, ..SolverOptions::default() };
    let damage = Some(PhaseField::new(0.06));
    let test = CompressionTest::new(
        mesh,
        Order::Quadratic,
        vec![matrix, grain],
        damage,
        loading,
        options,
    )?;
    line("unknowns", test.unknowns() as f64, "1");
    line("setup", clock.elapsed().as_secs_f64(), "s");
    line("memory_after_setup", peak_memory_gb(), "GB");

    let (mut taken, mut newton, mut before) = (0, 0, Instant::now());
    let start = before;
    let mut follow = |point: &CurvePoint, _: &Fields| {
        taken += 1;
        newton += point.newton;
        line(&format!("step_{taken}"), before.elapsed().as_secs_f64(), "s");
        line(&format!("step_{taken}_newton"), f64::from(point.newton), "1");
        line(&format!("step_{taken}_force"), point.force_n, "N");
        before = Instant::now();
        if taken >= steps { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = test.run(&mut follow);
    let seconds = start.elapsed().as_secs_f64();
    line("linear_iterations", f64::from(outcome.effort.linear), "1");
    line("hierarchies", f64::from(outcome.effort.factorisations), "1");
    line("memory_peak", peak_memory_gb(), "GB");
    line("newton_iteration", seconds / f64::from(newton.max(1)), "s");
    let to_peak = (f64::from(STEPS) * PEAK_MM / DISPLACEMENT_MM).ceil();
    line("steps_to_the_peak", to_peak, "1");
    line("hours_to_the_peak", to_peak * seconds / f64::from(taken.max(1) as u32) / 3600.0, "h");
    Ok(())
}

fn line(quantity: &str, value: f64, unit: &str) {
    println!("{quantity},{value:.4},{unit}");
}

/// The most memory that this process has held.
fn peak_memory_gb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = text.lines().find_map(|l| l.strip_prefix("VmHWM:")?.split_whitespace().next());
    peak.and_then(|x| x.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0 / 1024.0)
}
