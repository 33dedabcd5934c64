//! Cost of a viscoelastic and of a plastic matrix, relative to an elastic matrix, per Newton iteration.
//!
//! ```text
//! cargo bench -p fem --bench inelastic -- [ROUNDS]
//! ```
//!
//! The tests compress a packing (a fifth of grains) with quadratic elements and damage until the force is 30 % below
//! its peak: elements that are partly grain for the Prony series (three terms), a mesh that follows the grains for J2
//! plasticity. Elastic and inelastic runs alternate; the ratio is the median of the ratios of the rounds (default:
//! three). Printed as CSV: the law, load steps, Newton iterations, force at the end as a fraction of the peak,
//! processor seconds for each Newton iteration, and these seconds divided by the processor seconds for each Newton
//! iteration of the elastic run.

use std::error::Error;
use std::fs;

use fem::{
    CompressionTest, Fracture, GrainList, GrainMode, Hardening, Homogenisation, Material, Meshing,
    Order, Outcome, Packing, PhaseField, Plasticity, Problem, PronyTerm, Schedule, Viscoelasticity,
};

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
const SPACING_MM: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let rounds = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(3);
    println!("law,steps,newton,end_fraction,seconds_per_iteration,ratio");
    let prony = [(0.2, 0.05), (0.2, 0.3), (0.1, 2.0)];
    let terms = prony.map(|(fraction, time_s)| PronyTerm { fraction, time_s });
    let viscoelastic = matrix().with_viscoelasticity(Viscoelasticity::shear(terms));
    let hardening = Hardening::Linear { modulus_mpa: 30.0 };
    let plastic = matrix().with_plasticity(Plasticity { hardening, ..Plasticity::new(8.0) });
    for (name, material, mode) in
        [("prony", viscoelastic, GrainMode::Fraction), ("j2", plastic, GrainMode::Conforming)]
    {
        let [elastic, inelastic] = [matrix(), material].map(|own| problem(own, mode));
        let (elastic, inelastic) = (elastic?, inelastic?);
        let mut ratios = Vec::new();
        for round in 0..rounds {
            let [(reference, before), (outcome, after)] = [&elastic, &inelastic].map(timed);
            if round == 0 {
                print_row("elastic", &reference, before, 1.0);
            }
            ratios.push(after / before);
            if round + 1 == rounds {
                ratios.sort_by(f64::total_cmp);
                print_row(name, &outcome, after, ratios[rounds / 2]);
            }
        }
    }
    Ok(())
}

fn print_row(name: &str, outcome: &Outcome, seconds: f64, ratio: f64) {
    let peak = outcome.curve.iter().map(|point| point.force_n).fold(0.0, f64::max);
    let end = outcome.curve.last().map_or(f64::NAN, |point| point.force_n / peak);
    let (steps, newton) = (outcome.curve.len(), outcome.effort.iterations);
    println!("{name},{steps},{newton},{end:.3},{seconds:.4},{ratio:.2}");
}

/// Runs a problem. Also returns the processor seconds for each Newton iteration.
fn timed(problem: &Problem) -> (Outcome, f64) {
    let begin = processor_seconds();
    let outcome = problem.run(&mut ());
    let seconds = (processor_seconds() - begin) / f64::from(outcome.effort.iterations.max(1));
    (outcome, seconds)
}

fn matrix() -> Material {
    Material::hencky(275.0, 0.25)
}

fn problem(matrix: Material, mode: GrainMode) -> Result<Problem, Box<dyn Error>> {
    let grains = Packing { film_mm: 0.2, ..Packing::new(0.2, 1) }.fill(RADIUS_MM, HEIGHT_MM)?;
    let grains = GrainList::new(grains, RADIUS_MM, HEIGHT_MM);
    let meshing = Meshing { mode, curved: true, ..Meshing::new(SPACING_MM) };
    let mesh = meshing.build(RADIUS_MM, HEIGHT_MM, &grains)?.mesh;
    let fracture =
        Fracture { toughness_n_per_mm: 0.0025, viscosity_mpa_s: 0.3, residual_stiffness: 0.01 };
    let schedule = Schedule::fixed(1.0, 44).stop_below_peak(0.3);
    Ok(CompressionTest::new(0.22, schedule)
        .builder(mesh)?
        .order(Order::Quadratic)
        .homogenisation(Homogenisation::GeometricMean)
        .materials([matrix.with_fracture(fracture), Material::hencky(22_000.0, 0.25)])
        .phase_field(PhaseField::new(0.06))
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
