//! Relaxation of a mixture against a mesh that follows the grains: 31 spheres, 20 % of the volume, in a viscoelastic
//! matrix (Prony series of three terms).
//!
//! ```text
//! cargo bench -p fem --bench relaxing_mixture -- [SPACING_MM ...] [reference=SPACING_MM]
//! ```
//!
//! The specimen is compressed by 0.5 % in 0.1 s and held for 1.9 s, without damage. Default: the reference mesh follows
//! the grains with a spacing of 0.5 mm, and mixtures have spacings of 0.7 and 0.5 mm (geometric mean of Reuss and
//! Hashin–Shtrikman); all elements are quadratic. Printed as CSV: time, force with the reference mesh, then for each
//! mixture force and difference in %. The rows `elastic` compare elastic matrices with the moduli at time zero and after
//! infinite time: the difference of the relaxing mixture should lie between these two.

use std::error::Error;

use fem::{
    Axis, Conditions, Grain, GrainList, GrainMode, Material, Meshing, Order, Problem, PronyTerm,
    Schedule, Viscoelasticity,
};

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
const YOUNG_MPA: f64 = 275.0;
const POISSON: f64 = 0.25;
const STEPS: u32 = 20;
const DURATION_S: f64 = 2.0;
const TRAVEL_MM: f64 = 0.022;
/// Fractions and relaxation times (s) of the matrix.
const TERMS: [(f64, f64); 3] = [(0.2, 0.05), (0.2, 0.3), (0.1, 2.0)];

#[derive(serde::Deserialize)]
struct Packing {
    centres_mm: Vec<[f64; 3]>,
    radii_mm: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let packing: Packing = serde_json::from_str(include_str!("spheres20.json"))?;
    let spheres = packing.centres_mm.iter().zip(&packing.radii_mm);
    let spheres = spheres.map(|(&centre, &radius)| Grain::sphere(centre, radius)).collect();
    let grains = GrainList::new(spheres, RADIUS_MM, HEIGHT_MM);
    let (mut spacings, mut reference_mm) = (Vec::new(), 0.5);
    for argument in std::env::args().skip(1) {
        if let Some(text) = argument.strip_prefix("reference=") {
            reference_mm = text.parse()?;
        } else if let Ok(spacing) = argument.parse::<f64>() {
            spacings.push(spacing);
        }
    }
    if spacings.is_empty() {
        spacings = vec![0.7, 0.5];
    }
    let meshes: Vec<(GrainMode, f64)> = [(GrainMode::Conforming, reference_mm)]
        .into_iter()
        .chain(spacings.iter().map(|&spacing| (GrainMode::Fraction, spacing)))
        .collect();
    let names = spacings.iter().map(|spacing| format!(",mixture_{spacing}_mm_n,difference_%"));
    println!("time_s,reference_n{}", names.collect::<String>());
    let terms = TERMS.map(|(fraction, time_s)| PronyTerm { fraction, time_s });
    let relaxing =
        Material::hencky(YOUNG_MPA, POISSON).with_viscoelasticity(Viscoelasticity::shear(terms));
    let curves: Vec<Vec<[f64; 2]>> = meshes
        .iter()
        .map(|&(mode, spacing)| forces(&relaxing, mode, spacing, &grains, STEPS))
        .collect::<Result<_, _>>()?;
    for step in 0..STEPS as usize {
        let forces: Vec<f64> = curves.iter().map(|curve| curve[step][1]).collect();
        print_row(&format!("{:.1}", curves[0][step][0]), &forces);
    }
    let remaining = 1.0 - TERMS.iter().map(|(fraction, _)| fraction).sum::<f64>();
    for (name, fraction) in [("elastic at time zero", 1.0), ("elastic at infinity", remaining)] {
        let matrix = relaxed(fraction);
        let forces: Vec<f64> = meshes
            .iter()
            .map(|&(mode, spacing)| Ok(forces(&matrix, mode, spacing, &grains, 1)?[0][1]))
            .collect::<Result<_, Box<dyn Error>>>()?;
        print_row(name, &forces);
    }
    println!("processor_seconds,{:.0}", processor_seconds());
    Ok(())
}

/// Prints the force of the reference mesh, and force and difference of each mixture.
fn print_row(name: &str, forces: &[f64]) {
    let differences = forces[1..]
        .iter()
        .map(|force| format!(",{force:.3},{:.2}", 100.0 * (force / forces[0] - 1.0)));
    println!("{name},{:.3}{}", forces[0], differences.collect::<String>());
}

/// Elastic matrix whose shear modulus has relaxed to a fraction. The bulk modulus does not relax.
fn relaxed(fraction: f64) -> Material {
    let bulk = YOUNG_MPA / (3.0 * (1.0 - 2.0 * POISSON));
    let shear = fraction * YOUNG_MPA / (2.0 * (1.0 + POISSON));
    let young_mpa = 9.0 * bulk * shear / (3.0 * bulk + shear);
    Material::hencky(young_mpa, (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear))
}

/// Returns time and force at the end of each step, for a body that is compressed in the first step and held.
fn forces(
    matrix: &Material,
    mode: GrainMode,
    spacing_mm: f64,
    grains: &GrainList,
    steps: u32,
) -> Result<Vec<[f64; 2]>, Box<dyn Error>> {
    let meshing = Meshing { mode, curved: true, ..Meshing::new(spacing_mm) };
    let mesh = meshing.build(RADIUS_MM, HEIGHT_MM, grains)?.mesh;
    let held = |time_s: f64| if time_s > 0.0 { -TRAVEL_MM } else { 0.0 };
    let conditions = Conditions::new()
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, held(time_s)])
        .remove_rigid_motions()
        .measure("top", [0.0, 0.0, -1.0]);
    let outcome = Problem::builder(mesh)
        .order(Order::Quadratic)
        .materials([matrix.clone(), Material::hencky(22_000.0, 0.25)])
        .conditions(conditions)
        .schedule(Schedule::fixed(DURATION_S, steps))
        .build()?
        .run(&mut ());
    if outcome.curve.len() != steps as usize {
        return Err(format!("the run ended early: {:?}", outcome.end).into());
    }
    Ok(outcome.curve.iter().map(|point| [point.time_s, point.force_n]).collect())
}

/// Processor time of this process, s; NaN on systems without `/proc/self/task`.
fn processor_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let times = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    times.reduce(|a, b| a + b).map_or(f64::NAN, |nanoseconds| 1e-9 * nanoseconds)
}
