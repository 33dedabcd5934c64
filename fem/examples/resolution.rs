//! What a mesh costs and how near it comes: one packing of 31 spheres, a fifth of the volume, by
//! spacing, by how grains become part of the mesh, and by the order of the elements.
//!
//! ```text
//! cargo run --release -p fem --example resolution -- spheres20.json [ROW ...]
//! ```
//!
//! The file has `centres_mm` and `radii_mm`. A row is spacing, mode, order and rule, as
//! `0.7,fraction,p2,geometric-mean`; without rows those of the table below are run. Printed as CSV:
//! errors of slope, peak force and displacement at the peak against the reference in %, unknowns,
//! Newton iterations and processor seconds of 44 steps to 0.22 mm. The reference is a conforming
//! quadratic mesh, extrapolated: 1824 N/mm, 127.0 N (± 2–3 %), 0.0976 mm. Grains do not break.

use fem::{
    CompressionTest, CurvePoint, Fracture, Grain, GrainList, GrainMode, Homogenisation, Material,
    Meshing, Order, PhaseField, Schedule, TetMesh,
};

type Failure = Box<dyn std::error::Error>;

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
/// Slope (N/mm), peak force (N), displacement at the peak (mm).
const REFERENCE: [f64; 3] = [1824.0, 127.0, 0.0976];
const ROWS: [&str; 6] = [
    "0.7,whole,p1,reuss",
    "0.7,whole,p2,reuss",
    "0.7,fraction,p1,geometric-mean",
    "0.7,fraction,p2,reuss",
    "0.7,fraction,p2,geometric-mean",
    "0.7,fraction,p2,hashin-shtrikman",
];

#[derive(serde::Deserialize)]
struct Packing {
    centres_mm: Vec<[f64; 3]>,
    radii_mm: Vec<f64>,
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("name the file of the packing, as spheres20.json")?;
    let packing: Packing = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let spheres = packing.centres_mm.iter().zip(&packing.radii_mm);
    let spheres = spheres.map(|(&centre, &radius)| Grain::sphere(centre, radius)).collect();
    let grains = GrainList::new(spheres, RADIUS_MM, HEIGHT_MM);
    let mut rows: Vec<String> = arguments.collect();
    if rows.is_empty() {
        rows = ROWS.map(String::from).to_vec();
    }
    println!("spacing_mm,mode,order,rule,slope_%,peak_%,displacement_%,unknowns,newton,seconds");
    for row in rows {
        let parts: Vec<&str> = row.split(',').collect();
        let &[spacing, mode, order, rule] = parts.as_slice() else {
            return Err(format!("{row}: give spacing,mode,order,rule").into());
        };
        let order = if order == "p1" { Order::Linear } else { Order::Quadratic };
        let rule: Homogenisation = serde_json::from_value(rule.into())?;
        let mode: GrainMode = serde_json::from_value(mode.into())?;
        let mesh = mesh(spacing.parse()?, mode, order, &grains)?;
        let begin = processor_seconds();
        let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 44))
            .builder(mesh)?
            .order(order)
            .materials(materials())
            .homogenisation(rule)
            .phase_field(PhaseField::new(0.06))
            .build()?;
        let outcome = problem.run(&mut ());
        let newton = outcome.effort.iterations;
        let errors = measure(&outcome.curve)?;
        let errors: Vec<String> = errors
            .iter()
            .zip(REFERENCE)
            .map(|(x, r)| format!("{:.1}", 100.0 * (x / r - 1.0)))
            .collect();
        let (errors, unknowns) = (errors.join(","), problem.unknowns());
        println!("{row},{errors},{unknowns},{newton},{:.1}", processor_seconds() - begin);
    }
    Ok(())
}

/// Processor time of this process, s; not a number where Linux does not tell it.
fn processor_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let times = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse::<f64>().ok()
    });
    times.reduce(|a, b| a + b).map_or(f64::NAN, |nanoseconds| 1e-9 * nanoseconds)
}

/// The baseline matrix, and grains that do not break.
fn materials() -> [Material; 2] {
    let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    });
    [matrix, Material::hencky(22_000.0, 0.25)]
}

/// Slope by least squares through the points around 0.3 of the displacement at the peak, and the peak
/// by a parabola.
fn measure(curve: &[CurvePoint]) -> Result<[f64; 3], Failure> {
    let top = (0..curve.len())
        .max_by(|&a, &b| curve[a].force_n.total_cmp(&curve[b].force_n))
        .filter(|&top| top > 0 && top + 1 < curve.len())
        .ok_or("the curve has no peak")?;
    let [a, b, c] = [top - 1, top, top + 1].map(|k| (curve[k].displacement_mm, curve[k].force_n));
    let h = b.0 - a.0;
    let (slope, bend) = ((c.1 - a.1) / (2.0 * h), (c.1 - 2.0 * b.1 + a.1) / (h * h));
    let (at, peak) = (b.0 - slope / bend, b.1 - 0.5 * slope * slope / bend);
    let near = curve.iter().filter(|p| (p.displacement_mm / at - 0.3).abs() <= 0.1);
    let points: Vec<_> = near.map(|p| (p.displacement_mm, p.force_n)).collect();
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / count, y + p.1 / count));
    let (xy, xx) = points
        .iter()
        .fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - x) * (p.1 - y), xx + (p.0 - x) * (p.0 - x)));
    Ok([xy / xx, peak, at])
}

/// A mesh whose edges are curved where the elements can be.
fn mesh(
    spacing_mm: f64,
    mode: GrainMode,
    order: Order,
    grains: &GrainList,
) -> Result<TetMesh, Failure> {
    let curved = order == Order::Quadratic;
    let meshing = Meshing { mode, curved, ..Meshing::new(spacing_mm) };
    Ok(meshing.build(RADIUS_MM, HEIGHT_MM, grains)?.mesh)
}
