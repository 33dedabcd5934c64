//! Cost of the derivatives of the force with respect to E, Gc and ξ of the matrix, for a specimen with grains.
//!
//! ```text
//! cargo bench -p fem --bench sensitivity [REPETITIONS]
//! ```
//!
//! Two cases run beyond the peak in 44 steps on one thread: linear elements of 0.7 mm with a sparse factor, and
//! quadratic elements of 0.9 mm with multigrid. Output as CSV lines `quantity,value,unit`: the smallest processor
//! seconds of `REPETITIONS` runs (default 3) without and with derivatives, and the additional time as a fraction of the
//! time without derivatives.

use std::time::Instant;

use fem::{
    CompressionTest, CylinderLattice, Fracture, LinearScheme, Material, MaterialParameter, Order,
    Packing, PhaseField, Problem, Schedule, SolverOptions, label,
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let repetitions: u32 = std::env::args().nth(1).map_or(Ok(3), |a| a.parse())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!("quantity,value,unit");
    let cases = [
        ("p1_direct", 0.7, Order::Linear, LinearScheme::Direct),
        ("p2_multigrid", 0.9, Order::Quadratic, LinearScheme::Multigrid),
    ];
    for (name, spacing_mm, order, linear) in cases {
        let plain = problem(spacing_mm, order, linear)?;
        let with = plain.with_sensitivities(parameters())?;
        println!("{name}_unknowns,{},1", plain.unknowns());
        let mut least = [f64::INFINITY; 2];
        for _ in 0..repetitions {
            for (problem, least) in [&plain, &with].into_iter().zip(&mut least) {
                let begin = processor_seconds();
                let outcome = pool.install(|| problem.run(&mut ()));
                *least = least.min(processor_seconds() - begin);
                if outcome.curve.len() != 44 {
                    return Err(format!("{name} ended early: {:?}", outcome.end).into());
                }
            }
        }
        println!("{name}_without,{:.3},s", least[0]);
        println!("{name}_with,{:.3},s", least[1]);
        println!("{name}_added,{:.3},1", least[1] / least[0] - 1.0);
    }
    Ok(())
}

fn materials(young_mpa: f64, toughness_n_per_mm: f64, viscosity_mpa_s: f64) -> Vec<Material> {
    let residual_stiffness = 0.01;
    let matrix = Fracture { toughness_n_per_mm, viscosity_mpa_s, residual_stiffness };
    let grain = Fracture { toughness_n_per_mm: 1.83, viscosity_mpa_s: 0.1, residual_stiffness };
    vec![
        Material::hencky(young_mpa, 0.25).with_fracture(matrix),
        Material::hencky(22_000.0, 0.25).with_fracture(grain),
    ]
}

fn parameters() -> Vec<MaterialParameter> {
    vec![
        MaterialParameter::new("young_mpa", 275.0, |x| materials(x, 0.0025, 0.3)),
        MaterialParameter::new("toughness_n_per_mm", 0.0025, |x| materials(275.0, x, 0.3)),
        MaterialParameter::new("viscosity_mpa_s", 0.3, |x| materials(275.0, 0.0025, x)),
    ]
}

fn problem(spacing_mm: f64, order: Order, linear: LinearScheme) -> Result<Problem, Failure> {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm };
    let mut mesh = lattice.build()?;
    label(&mut mesh, &Packing::new(0.2, 1).fill(lattice.radius_mm, lattice.height_mm)?);
    Ok(CompressionTest::new(0.22, Schedule::fixed(1.0, 44))
        .builder(mesh)?
        .order(order)
        .materials(materials(275.0, 0.0025, 0.3))
        .phase_field(PhaseField::new(0.06))
        .options(SolverOptions { linear, ..SolverOptions::default() })
        .build()?)
}

/// Processor time of this process, s; on systems without `/proc/self/task`, the wall-clock time since the first call.
fn processor_seconds() -> f64 {
    thread_local!(static START: Instant = Instant::now());
    std::thread::sleep(std::time::Duration::from_millis(1));
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let nanoseconds: u64 = tasks
        .filter_map(|task| std::fs::read_to_string(task.path().join("schedstat")).ok())
        .filter_map(|text| text.split(' ').next()?.parse::<u64>().ok())
        .sum();
    let wall = START.with(|start| start.elapsed().as_secs_f64());
    if nanoseconds > 0 { 1e-9 * nanoseconds as f64 } else { wall }
}
