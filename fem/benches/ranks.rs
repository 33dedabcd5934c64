//! Cost of a run on several ranks: number of iterations, and amount of communication.
//!
//! ```text
//! cargo bench -p fem --features bench-internals --bench ranks -- [SPACING_MM] [RANKS…]
//! cargo bench -p fem --features bench-internals --bench ranks -- 0.4 1 2 4 8
//! ```
//!
//! `SPACING_MM` is the spacing of the mesh in mm (default 0.5), `RANKS` are numbers of ranks. In this benchmark, ranks
//! are threads of one process. The specimen contains 20 % of grains. A run stops when the force is 10 % below its peak.

use fem::{
    CompressionTest, CylinderLattice, Fracture, LinearScheme, Material, Order, Packing, PhaseField,
    Ranks, Schedule, SolverOptions, TetMesh, bench, label,
};

fn material(young_mpa: f64, toughness_n_per_mm: f64, viscosity_mpa_s: f64) -> Material {
    let fracture = Fracture { toughness_n_per_mm, viscosity_mpa_s, residual_stiffness: 0.01 };
    Material::hencky(young_mpa, 0.25).with_fracture(fracture)
}

fn specimen(spacing_mm: f64) -> Result<TetMesh, Box<dyn std::error::Error>> {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm };
    let mut mesh = lattice.build()?;
    let grains = Packing::new(0.2, 1).fill(lattice.radius_mm, lattice.height_mm)?;
    label(&mut mesh, &grains);
    Ok(mesh)
}

/// Runs the specimen on one of the ranks; the first rank prints the cost.
fn run(mesh: TetMesh, ranks: Ranks) -> Result<(), fem::FemError> {
    let (rank, size) = (ranks.rank(), ranks.size());
    let options = SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() };
    let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 44).stop_below_peak(0.1))
        .builder(mesh)?
        .order(Order::Quadratic)
        .materials([material(275.0, 0.0025, 0.3), material(22_000.0, 1.83, 0.1)])
        .phase_field(PhaseField::new(0.06))
        .options(options)
        .ranks(ranks)
        .build()?;
    let start = std::time::Instant::now();
    let outcome = problem.run(&mut ());
    if rank == 0 {
        let peak = outcome.curve.iter().map(|p| p.force_n).fold(0.0, f64::max);
        let effort = outcome.effort;
        println!(
            "{size} ranks: {} unknowns, {} steps, peak {peak:.6} N, {} Newton, {} linear ({:.2} each), {} \
             hierarchies, {:.1} s",
            problem.unknowns(),
            outcome.curve.len(),
            effort.iterations,
            effort.linear,
            f64::from(effort.linear) / f64::from(effort.iterations),
            effort.factorisations,
            start.elapsed().as_secs_f64(),
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let spacing_mm = arguments.next().map_or(Ok(0.5), |x| x.parse())?;
    let mesh = specimen(spacing_mm)?;
    println!("{} quadratic tetrahedra", mesh.tets.len());
    for count in [2, 8, 64, 512] {
        let sizes = bench::parts(&mesh, count);
        let sum =
            |size: fn(&bench::PartSize) -> usize| sizes.iter().map(size).sum::<usize>() as f64;
        let most = sizes.iter().map(|p| p.ghosts[0]).max().unwrap_or(0);
        println!(
            "{count:4} parts: {:6.0} elements each, ghosts {:5.1} % of the nodes ({:5.1} % of the vertices), at \
             most {most}, {:4.1} neighbours, {:6.0} kB per product and part",
            sum(|p| p.elements) / count as f64,
            100.0 * sum(|p| p.ghosts[0]) / sum(|p| p.nodes[0]),
            100.0 * sum(|p| p.ghosts[1]) / sum(|p| p.nodes[1]),
            sum(|p| p.neighbours) / count as f64,
            // in a product, each ghost sends four f64 numbers to the owner of its node, and the owner sends four
            // numbers back
            sum(|p| p.ghosts[0]) * 64.0 / count as f64 / 1e3,
        );
    }
    for count in arguments {
        let threads: Vec<_> = Ranks::threads(count.parse()?)
            .into_iter()
            .map(|ranks| {
                let mesh = mesh.clone();
                std::thread::spawn(move || run(mesh, ranks))
            })
            .collect();
        for thread in threads {
            thread.join().map_err(|_| "a rank has panicked")??;
        }
    }
    Ok(())
}
