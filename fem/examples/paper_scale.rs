//! How far a workstation comes with the mesh of the method paper: a cylinder of quadratic
//! tetrahedra with thousands of grains, 12.3 million unknowns.
//!
//! ```text
//! cargo run --release -p fem --example paper_scale -- [FRACTION] [STEPS]
//! ```
//!
//! `FRACTION` is the fraction of the 2.3 million tetrahedra (default 0.125), `STEPS` the load steps to
//! take (default 2) of the 88 equal ones to 0.22 mm; with more than the peak needs, it ends there.
//! Printed as CSV `quantity,value,unit`: set-up, seconds and iterations of every step, memory, and
//! the step of the largest force.
//!
//! Measured on two cores beside other work, so in processor seconds where it says so:
//!
//! | fraction | tetrahedra | unknowns | grains | peak at step | Newton iterations to it |
//! |---|---|---|---|---|---|
//! | 0.002 | 4 820 | 29 423 | 15 | 39 | 123 |
//! | 0.005 | 13 580 | 79 375 | 33 | 38 | 117 |
//! | 0.02 | 50 996 | 289 119 | 135 | 41 | 132 |
//!
//! The grains grow with the elements, so these are specimens of one kind, not one specimen. Fraction
//! 0.125 (314 400 tetrahedra, 1.73 million unknowns, 834 grains) took 8, 3 and 3 Newton iterations
//! for its first three steps, 7.9 linear iterations and 6 processor seconds each, 1.6 GB at most.
//! Fraction 1 (2 393 196 tetrahedra, 12.98 million unknowns, 6404 grains) was set up in 49 s; its first
//! load step took 14 Newton iterations (the coarser ones: 5 to 8), 8.6 linear iterations and 74
//! processor seconds each, two hierarchies, 10.6 GB at most.
//!
//! So a full run to the peak is some 40 steps of 3 to 4 iterations, about 140 in all: three processor
//! hours, 1.5 hours of two cores that both threads keep busy. What was seen were 91 s on the wall for an
//! iteration at low priority beside light work (3.5 hours), and 202 s beside heavy work (8 hours).

use std::ops::ControlFlow;
use std::time::Instant;

use fem::{
    CompressionTest, CurvePoint, CylinderLattice, Fields, Fracture, Material, Order, Packing,
    PhaseField, Schedule, SizeClass, SolverOptions, label,
};

const TETRAHEDRA: f64 = 2.3e6;
const STEPS: u32 = 88;
const DISPLACEMENT_MM: f64 = 0.22;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let fraction: f64 = arguments.next().map_or(Ok(0.125), |a| a.parse())?;
    let steps: usize = arguments.next().map_or(Ok(2), |a| a.parse())?;
    println!("quantity,value,unit");

    let clock = Instant::now();
    let (radius_mm, height_mm) = (2.5, 4.4);
    let volume = std::f64::consts::PI * radius_mm * radius_mm * height_mm;
    // twelve tetrahedra to a cell of the lattice
    let spacing_mm = (12.0 * volume / (fraction * TETRAHEDRA)).cbrt();
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

    let fracture = |toughness_n_per_mm| Fracture {
        toughness_n_per_mm,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    };
    let matrix = Material::hencky(275.0, 0.25).with_fracture(fracture(0.0025));
    let grain = Material::hencky(22_000.0, 0.25).with_fracture(fracture(3.5));
    let loading = CompressionTest::new(DISPLACEMENT_MM, Schedule::fixed(1.0, STEPS));
    let options = SolverOptions { tolerance: 1e-5, ..SolverOptions::default() };
    let damage = Some(PhaseField::new(0.06));
    let test = loading
        .builder(mesh)?
        .order(Order::Quadratic)
        .materials([matrix, grain])
        .phase_field(damage)
        .options(options)
        .build()?;
    line("unknowns", test.unknowns() as f64, "1");
    line("setup", clock.elapsed().as_secs_f64(), "s");
    line("memory_after_setup", peak_memory_gb(), "GB");

    let (mut taken, mut newton, mut peak, mut before) = (0, 0, (0, 0.0), Instant::now());
    let start = before;
    let mut follow = |point: &CurvePoint, _: &Fields| {
        taken += 1;
        newton += point.newton;
        line(&format!("step_{taken}"), before.elapsed().as_secs_f64(), "s");
        line(&format!("step_{taken}_newton"), f64::from(point.newton), "1");
        line(&format!("step_{taken}_force"), point.force_n, "N");
        before = Instant::now();
        if point.force_n > peak.1 {
            peak = (taken, point.force_n);
        }
        let over = taken >= steps || taken > peak.0;
        if over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let outcome = test.run(&mut follow);
    let seconds = start.elapsed().as_secs_f64();
    line("linear_iterations", f64::from(outcome.effort.linear), "1");
    line("hierarchies", f64::from(outcome.effort.factorisations), "1");
    line("fallbacks", f64::from(outcome.effort.fallbacks), "1");
    line("memory_peak", peak_memory_gb(), "GB");
    line("newton_iteration", seconds / f64::from(newton.max(1)), "s");
    if taken > peak.0 {
        line("steps_to_the_peak", peak.0 as f64, "1");
        line("newton_to_the_peak", f64::from(newton), "1");
    }
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
