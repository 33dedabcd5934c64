//! What the engine costs: CSV lines `quantity,value,unit`, one thread.
//!
//! Run: `cargo bench -p fem --bench engine`. The specimen is a lattice cylinder; the figures are
//! the least of a few repetitions. `BRECCIA_LARGE=1` adds the sizes up to two million unknowns,
//! which take minutes and several GB.

use std::time::Instant;

use fem::{
    CompressionTest, CylinderLattice, ElasticLaw, Loading, Material, Order, PhaseField,
    SolverOptions, Stepping,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    rayon_of_one()?;
    println!("quantity,value,unit");
    line("load_of_the_machine", load(), "1");
    parts("p1_3k", 0.7, Order::Linear, true, 5)?;
    parts("p1_20k", 0.38, Order::Linear, true, 5)?;
    parts("p1_displacement", 0.237, Order::Linear, false, 3)?;
    parts("p2_displacement", 0.36, Order::Quadratic, false, 3)?;
    parts("p2_4_fields", 0.38, Order::Quadratic, true, 3)?;
    run("run_20k", 0.38)?;
    run("run_40k", 0.302)?;
    line("memory_peak", peak_memory_mb(), "MB");
    line("load_of_the_machine_at_the_end", load(), "1");
    Ok(())
}

fn line(quantity: &str, value: f64, unit: &str) {
    println!("{quantity},{value:.4},{unit}");
}

/// One thread for everything that follows.
fn rayon_of_one() -> Result<(), Failure> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?)
}

fn test(spacing_mm: f64, order: Order, damage: bool) -> Result<CompressionTest, Failure> {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm }.build()?;
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
        stop_below_peak: None,
    };
    let options = SolverOptions::default();
    let field = damage.then_some(field);
    Ok(CompressionTest::new(mesh, order, vec![matrix], field, loading, options)?)
}

/// The parts of a Newton iteration.
fn parts(
    name: &str,
    spacing_mm: f64,
    order: Order,
    damage: bool,
    repetitions: u32,
) -> Result<(), Failure> {
    let begin = Instant::now();
    let test = test(spacing_mm, order, damage)?;
    line(&format!("{name}_setup"), begin.elapsed().as_secs_f64(), "s");
    let tets = test.mesh().tets.len() as f64;
    let unknowns = test.unknowns() as f64;
    line(&format!("{name}_tetrahedra"), tets, "1");
    line(&format!("{name}_unknowns"), unknowns, "1");
    line(&format!("{name}_factor_entries"), test.factor_entries() as f64, "1");
    let parts = test.time_parts(repetitions)?;
    line(&format!("{name}_residual"), 1e6 * parts.residual_s / tets, "us/tet");
    line(&format!("{name}_tangent"), 1e6 * parts.tangent_s / tets, "us/tet");
    let both = parts.residual_s + parts.tangent_s;
    line(&format!("{name}_residual_and_tangent"), 1e6 * both / tets, "us/tet");
    line(&format!("{name}_linearise"), 1e6 * parts.linearise_s / tets, "us/tet");
    line(&format!("{name}_apply"), 1e-6 * unknowns / parts.apply_s, "million unknowns/s");
    line(&format!("{name}_factorisation"), parts.factorisation_s, "s");
    line(&format!("{name}_solve"), parts.solve_s, "s");
    line(&format!("{name}_newton_iteration"), parts.newton_iteration_s(), "s");
    Ok(())
}

/// A fracture run of 44 steps past the peak.
fn run(name: &str, spacing_mm: f64) -> Result<(), Failure> {
    let test = test(spacing_mm, Order::Linear, true)?;
    line(&format!("{name}_tetrahedra"), test.mesh().tets.len() as f64, "1");
    let begin = Instant::now();
    let outcome = test.run(&mut ());
    let seconds = begin.elapsed().as_secs_f64();
    line(name, seconds, "s");
    line(&format!("{name}_steps"), outcome.curve.len() as f64, "1");
    line(&format!("{name}_iterations"), f64::from(outcome.effort.iterations), "1");
    line(&format!("{name}_linear_iterations"), f64::from(outcome.effort.linear), "1");
    line(&format!("{name}_factorisations"), f64::from(outcome.effort.factorisations), "1");
    line(
        &format!("{name}_newton_iteration_amortised"),
        seconds / f64::from(outcome.effort.iterations.max(1)),
        "s",
    );
    Ok(())
}

/// Processes that want to run, over the last minute.
fn load() -> f64 {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().and_then(|x| x.parse().ok()).unwrap_or(f64::NAN)
}

/// The most memory that this process has held.
fn peak_memory_mb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak =
        text.lines().find(|l| l.starts_with("VmHWM")).and_then(|l| l.split_whitespace().nth(1));
    peak.and_then(|x| x.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}
