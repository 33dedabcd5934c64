//! Costs of the finite element engine on one thread, in processor seconds, as CSV lines `quantity,value,unit`.
//!
//! ```text
//! cargo bench -p fem --features bench-internals --bench engine [-- NAME…]
//! ```
//!
//! `NAME` selects the quantities whose names begin with `NAME`, e.g. `p1_20k` or `apply`. The specimen is a lattice
//! cylinder with 20 % of grains, which are 80 times as stiff as the matrix. The tolerance is the default. Each time is
//! the smallest of several repetitions. The environment variable `BRECCIA_LARGE=1` adds meshes with up to two million
//! unknowns, which need minutes and several GB.

use std::ops::ControlFlow;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use fem::LinearScheme::{self, Auto, Direct, Multigrid};
use fem::bench::NewtonParts;
use fem::{
    CompressionTest, CurvePoint, CylinderLattice, Fields, Fracture, Material, Order, Packing,
    PhaseField, Problem, Schedule, SolverOptions, StepFailure, label,
};

type Failure = Box<dyn std::error::Error>;

fn main() {
    // run everything inside the pool's only thread, so that no thread waits for another thread
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| measure().expect("the cases of this file are valid"));
}

fn measure() -> Result<(), Failure> {
    let requested: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted =
        |name: &str| requested.is_empty() || requested.iter().any(|a| name.starts_with(a.as_str()));
    println!("quantity,value,unit");
    line("load_of_the_machine", load(), "1");
    // these runs come first, because the peak memory is a maximum over the whole process
    for (name, spacing_mm) in [("run_20k", 0.38), ("run_40k", 0.302)] {
        if wanted(name) {
            run(name, spacing_mm)?;
            line(&format!("{name}_memory_peak"), peak_memory_mb(), "MB");
        }
    }
    let (linear, quadratic) = (Order::Linear, Order::Quadratic);
    let sizes = [
        ("p1_3k", 0.7, linear, true, Auto),
        ("p1_20k", 0.38, linear, true, Auto),
        ("p1_160k", 0.19, linear, true, Multigrid),
        ("p1_displacement_44k", 0.248, linear, false, Direct),
        ("p1_multigrid_displacement_44k", 0.248, linear, false, Multigrid),
        ("p2_displacement_86k", 0.365, quadratic, false, Auto),
        ("p2_4_fields", 0.38, quadratic, true, Auto),
    ];
    let products = [
        ("apply_p1", 0.18, linear, true),
        ("apply_p1_displacement", 0.18, linear, false),
        ("apply_p2", 0.28, quadratic, true),
        ("apply_p2_displacement", 0.28, quadratic, false),
    ];
    if products.iter().any(|p| wanted(p.0)) {
        line("triad", triad(), "GB/s");
    }
    for (name, spacing_mm, order, damage) in products {
        if wanted(name) {
            product(name, spacing_mm, order, damage)?;
        }
    }
    for (name, spacing_mm, order, damage, linear) in sizes {
        if wanted(name) {
            let begin = processor_seconds();
            let test = test(spacing_mm, order, damage, linear)?;
            line(&format!("{name}_setup"), processor_seconds() - begin, "s");
            newton_costs(name, &test, 10)?;
        }
    }
    if std::env::var_os("BRECCIA_LARGE").is_some() {
        let mut figures = Vec::new();
        for (name, spacing_mm) in [("grow_20k", 0.38), ("grow_400k", 0.13), ("grow_2m", 0.0745)] {
            figures.push(steps(name, spacing_mm, 3)?);
        }
        let ([n, s], [m, t]) = (figures[0], figures[figures.len() - 1]);
        line("growth_of_the_newton_iteration", (t / s).ln() / (m / n).ln(), "1");
    }
    line("load_of_the_machine_at_the_end", load(), "1");
    Ok(())
}

fn line(quantity: &str, value: f64, unit: &str) {
    println!("{quantity},{value:.4},{unit}");
}

fn test(
    spacing_mm: f64,
    order: Order,
    damage: bool,
    linear: LinearScheme,
) -> Result<Problem, Failure> {
    let (radius_mm, height_mm) = (2.5, 4.4);
    let mut mesh = CylinderLattice { radius_mm, height_mm, spacing_mm }.build()?;
    label(&mut mesh, &Packing::new(0.2, 1).fill(radius_mm, height_mm)?);
    let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    });
    let grain = Material::hencky(22_000.0, 0.25);
    let field = PhaseField::new(0.06);
    let loading = CompressionTest::new(0.22, Schedule::fixed(1.0, 44));
    let options = SolverOptions { linear, ..SolverOptions::default() };
    let field = damage.then_some(field);
    Ok(loading
        .builder(mesh)?
        .order(order)
        .materials([matrix, grain])
        .phase_field(field)
        .options(options)
        .build()?)
}

/// Prints the costs of the parts of a Newton iteration.
fn newton_costs(name: &str, test: &Problem, repetitions: u32) -> Result<(), Failure> {
    let tets = test.mesh().tets.len() as f64;
    let unknowns = test.unknowns() as f64;
    line(&format!("{name}_tetrahedra"), tets, "1");
    line(&format!("{name}_unknowns"), unknowns, "1");
    line(&format!("{name}_factor_entries"), test.factor_entries() as f64, "1");
    let clock = &processor_seconds;
    let mut iteration = NewtonParts::new(test);
    let residual_s = least(clock, repetitions, || iteration.residual())?;
    let tangent_s = least(clock, repetitions, || iteration.linearise())?;
    let begin = clock();
    iteration.solve()?;
    let first_s = clock() - begin;
    let solve_s = least(clock, repetitions, || iteration.solve())?;
    let factorisation_s = first_s - solve_s;
    let both = residual_s + tangent_s;
    line(&format!("{name}_residual"), 1e6 * residual_s / tets, "us/tet");
    line(&format!("{name}_tangent"), 1e6 * tangent_s / tets, "us/tet");
    line(&format!("{name}_residual_and_tangent"), 1e6 * both / tets, "us/tet");
    line(&format!("{name}_factorisation"), factorisation_s, "s");
    line(&format!("{name}_solve"), solve_s, "s");
    line(&format!("{name}_newton_iteration"), both + factorisation_s + solve_s, "s");
    Ok(())
}

/// Prints the cost of a product with the matrix-free tangent, on a mesh whose data does not fit into any cache.
fn product(name: &str, spacing_mm: f64, order: Order, damage: bool) -> Result<(), Failure> {
    let test = test(spacing_mm, order, damage, Auto)?;
    let (tets, unknowns) = (test.mesh().tets.len() as f64, test.unknowns() as f64);
    line(&format!("{name}_tetrahedra"), tets, "1");
    line(&format!("{name}_unknowns"), unknowns, "1");
    let mut iteration = NewtonParts::new(&test);
    iteration.residual()?;
    iteration.store()?;
    let store_s = least(&wall_seconds, 3, || iteration.store())?;
    let apply_s = least(&wall_seconds, 100, || {
        iteration.apply();
        Ok(())
    })?;
    line(&format!("{name}_linearise"), 1e6 * store_s / tets, "us/tet");
    line(name, 1e-6 * unknowns / apply_s, "million unknowns/s");
    line(&format!("{name}_data"), 1e-9 * iteration.bytes() as f64 / apply_s, "GB/s");
    Ok(())
}

/// Returns the time of one call of `part`, s: the smallest mean of `repetitions` series of calls.
///
/// A series is only as long as the resolution of the clock requires (10 ms), so that other processes do not disturb every
/// series.
fn least(
    clock: &dyn Fn() -> f64,
    repetitions: u32,
    mut part: impl FnMut() -> Result<(), StepFailure>,
) -> Result<f64, StepFailure> {
    const SERIES_S: f64 = 0.01;
    let mut series = |calls: u32| -> Result<f64, StepFailure> {
        let begin = clock();
        (0..calls).try_for_each(|_| part())?;
        Ok(clock() - begin)
    };
    let mut calls = 1;
    let mut best = series(calls)?;
    while best < SERIES_S && calls < 1 << 20 {
        calls *= 2;
        best = series(calls)?;
    }
    for _ in 1..repetitions {
        best = best.min(series(calls)?);
    }
    Ok(best / f64::from(calls))
}

/// Returns the memory bandwidth in GB/s of a = b + s c (triad), counted as in McCalpin's STREAM: three numbers per entry.
fn triad() -> f64 {
    const ENTRIES: usize = 8 << 20;
    let (mut a, b, c) = (vec![0.0; ENTRIES], vec![1.0; ENTRIES], vec![2.0; ENTRIES]);
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let begin = wall_seconds();
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = b + 3.0 * c;
        }
        std::hint::black_box(&mut a);
        best = best.min(wall_seconds() - begin);
    }
    24e-9 * ENTRIES as f64 / best
}

/// Runs a fracture test of 44 steps beyond the peak force, and prints its cost.
fn run(name: &str, spacing_mm: f64) -> Result<(), Failure> {
    steps(name, spacing_mm, 44).map(|_| ())
}

/// Runs the first `count` of 44 load steps and prints their cost. Returns the number of unknowns, and the seconds per
/// Newton iteration.
fn steps(name: &str, spacing_mm: f64, count: usize) -> Result<[f64; 2], Failure> {
    let test = test(spacing_mm, Order::Linear, true, Auto)?;
    line(&format!("{name}_tetrahedra"), test.mesh().tets.len() as f64, "1");
    line(&format!("{name}_unknowns"), test.unknowns() as f64, "1");
    let mut taken = 0;
    let mut follow = |_: &CurvePoint, _: &Fields| {
        taken += 1;
        if taken < count { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    let begin = processor_seconds();
    let outcome = test.run(&mut follow);
    let seconds = processor_seconds() - begin;
    let effort = outcome.effort;
    let each = seconds / f64::from(effort.iterations.max(1));
    line(name, seconds, "s");
    line(&format!("{name}_steps"), outcome.curve.len() as f64, "1");
    line(&format!("{name}_iterations"), f64::from(effort.iterations), "1");
    line(&format!("{name}_linear_iterations"), f64::from(effort.linear), "1");
    line(&format!("{name}_factorisations"), f64::from(effort.factorisations), "1");
    line(&format!("{name}_newton_iteration_amortised"), each, "s");
    Ok([test.unknowns() as f64, each])
}

/// Wall-clock time, s, for measurements that are so short that some of them are not disturbed by
/// other processes.
fn wall_seconds() -> f64 {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGIN.elapsed().as_secs_f64()
}

/// Processor time of this process, s; on systems without `/proc/self/task`, the wall-clock time. Other processes increase
/// the processor time less than the wall-clock time.
fn processor_seconds() -> f64 {
    // Linux updates the time of a thread every few milliseconds, and whenever the thread sleeps
    std::thread::sleep(Duration::from_nanos(1));
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds: u64 = tasks
        .filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok())
        .filter_map(|text| text.split(' ').next()?.parse::<u64>().ok())
        .sum();
    if nanoseconds > 0 { 1e-9 * nanoseconds as f64 } else { wall_seconds() }
}

/// Mean number of runnable processes on the machine over the last minute (load average).
fn load() -> f64 {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split(' ').next().and_then(|x| x.parse().ok()).unwrap_or(f64::NAN)
}

/// Largest memory of this process so far, MiB.
fn peak_memory_mb() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak =
        text.lines().find(|l| l.starts_with("VmHWM")).and_then(|l| l.split_whitespace().nth(1));
    peak.and_then(|x| x.parse::<f64>().ok()).map_or(f64::NAN, |kb| kb / 1024.0)
}
