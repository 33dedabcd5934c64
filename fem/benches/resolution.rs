//! Accuracy and cost of meshes of one packing: 31 spheres, 20 % of the volume, which do not break.
//!
//! ```text
//! cargo bench -p fem --bench resolution -- [ROW ...]
//! cargo bench -p fem --bench resolution -- fine=ROW [ROW ...]
//! ```
//!
//! `ROW` is a discretisation: mesh spacing in mm, mode of the grains, element order and homogenisation rule, e.g.
//! `0.7,fraction,p2,geometric-mean`. Default: the rows of the constant `ROWS`. Each run compresses the specimen by
//! 0.22 mm in 44 steps. Output as CSV: errors in % of slope, peak force and displacement at the peak, number of unknowns,
//! Newton iterations, iterations of the linear solver, and processor seconds. The reference is extrapolated from
//! conforming quadratic meshes: 1824 N/mm, 127.0 N (± 2–3 %), 0.0976 mm.
//!
//! With `fine=ROW`, the quantities of the fine row are divided by the quantities of each other row, at eight points of
//! the prior's box. Output: mean of the ratios minus 1, and their standard deviation, both in %. A small standard
//! deviation means that a constant factor can correct the coarse row.

use fem::{
    CompressionTest, CurvePoint, Effort, Fracture, Grain, GrainList, GrainMode, Homogenisation,
    Material, Meshing, Order, PhaseField, Schedule,
};

type Failure = Box<dyn std::error::Error>;

const RADIUS_MM: f64 = 2.5;
const HEIGHT_MM: f64 = 4.4;
/// Reference values: slope (N/mm), peak force (N), displacement at the peak (mm).
const REFERENCE: [f64; 3] = [1824.0, 127.0, 0.0976];
const HEADER: &str = "spacing_mm,mode,order,rule";
/// Young's modulus (MPa), toughness (N/mm) and viscosity (MPa s) of the matrix in the baseline case.
const BASELINE: [f64; 3] = [275.0, 0.0025, 0.3];
/// Lower and upper limits of these three parameters in the prior.
const PRIOR: [[f64; 2]; 3] = [[250.0, 300.0], [0.00001, 0.005], [0.05, 0.55]];
/// Number of parameter points at which rows are compared.
const POINTS: usize = 8;
/// Discretisations that are run by default.
const ROWS: [&str; 9] = [
    "0.7,whole,p1,reuss",
    "0.7,whole,p2,reuss",
    "0.7,fraction,p1,geometric-mean",
    "1.0,fraction,p2,geometric-mean",
    "0.7,fraction,p2,reuss",
    "0.7,fraction,p2,geometric-mean",
    "0.7,fraction,p2,hashin-shtrikman",
    "0.5,fraction,p2,geometric-mean",
    "0.35,conforming,p2,reuss",
];

#[derive(serde::Deserialize)]
struct Packing {
    centres_mm: Vec<[f64; 3]>,
    radii_mm: Vec<f64>,
}

fn main() -> Result<(), Failure> {
    let packing: Packing = serde_json::from_str(include_str!("spheres20.json"))?;
    let spheres = packing.centres_mm.iter().zip(&packing.radii_mm);
    let spheres = spheres.map(|(&centre, &radius)| Grain::sphere(centre, radius)).collect();
    let grains = GrainList::new(spheres, RADIUS_MM, HEIGHT_MM);
    let (fine, mut rows): (Vec<String>, Vec<String>) = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .partition(|argument| argument.starts_with("fine="));
    let fine = fine.last().map(|argument| argument["fine=".len()..].to_owned());
    if rows.is_empty() {
        rows = ROWS.map(String::from).to_vec();
    }
    if let Some(fine) = fine {
        return compare(&Row::parse(&fine)?, &rows, &grains);
    }
    println!("{HEADER},slope_%,peak_%,displacement_%,unknowns,newton,linear,seconds");
    for text in rows {
        let begin = processor_seconds();
        let run = Row::parse(&text)?.run(BASELINE, &grains)?;
        let [slope, peak, at] = percent(run.quantities, REFERENCE);
        println!(
            "{text},{slope:.1},{peak:.1},{at:.1},{},{},{},{:.1}",
            run.unknowns,
            run.effort.iterations,
            run.effort.linear,
            processor_seconds() - begin
        );
    }
    Ok(())
}

/// Prints mean and standard deviation of the ratios of the fine row to each other row over the prior's box, in %.
fn compare(fine: &Row, rows: &[String], grains: &GrainList) -> Result<(), Failure> {
    let parameter_points: Vec<[f64; 3]> = (1..=POINTS)
        .map(|n| {
            std::array::from_fn(|k| {
                let [low, high] = PRIOR[k];
                low + (high - low) * halton(n, [2, 3, 5][k])
            })
        })
        .collect();
    let all = |row: &Row| -> Result<Vec<[f64; 3]>, Failure> {
        parameter_points.iter().map(|&at| Ok(row.run(at, grains)?.quantities)).collect()
    };
    let fine = all(fine)?;
    println!("{HEADER},slope_%,sd_%,peak_%,sd_%,displacement_%,sd_%");
    for text in rows {
        let row = all(&Row::parse(text)?)?;
        let ratios: Vec<_> = fine.iter().zip(&row).map(|(f, r)| percent(*f, *r)).collect();
        let figures: Vec<String> = (0..3)
            .map(|k| {
                let mean = ratios.iter().map(|r| r[k]).sum::<f64>() / POINTS as f64;
                let square = ratios.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>();
                format!("{mean:.1},{:.2}", (square / (POINTS - 1) as f64).sqrt())
            })
            .collect();
        println!("{text},{}", figures.join(","));
    }
    Ok(())
}

fn percent(value: [f64; 3], reference: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| 100.0 * (value[k] / reference[k] - 1.0))
}

/// The n-th number of Halton's sequence with the given base.
fn halton(mut n: usize, base: usize) -> f64 {
    let (mut sum, mut digit) = (0.0, 1.0);
    while n > 0 {
        digit /= base as f64;
        sum += digit * (n % base) as f64;
        n /= base;
    }
    sum
}

/// Discretisation of the specimen.
struct Row {
    spacing_mm: f64,
    mode: GrainMode,
    order: Order,
    rule: Homogenisation,
}

/// Results of a run.
struct Run {
    /// Slope (N/mm), peak force (N), displacement at the peak (mm).
    quantities: [f64; 3],
    unknowns: usize,
    effort: Effort,
}

impl Row {
    fn parse(text: &str) -> Result<Self, Failure> {
        let fields: Vec<&str> = text.split(',').collect();
        let &[spacing, mode, order, rule] = fields.as_slice() else {
            return Err(format!("{text}: give spacing,mode,order,rule").into());
        };
        Ok(Self {
            spacing_mm: spacing.parse()?,
            mode: serde_json::from_value(mode.into())?,
            order: if order == "p1" { Order::Linear } else { Order::Quadratic },
            rule: serde_json::from_value(rule.into())?,
        })
    }

    /// Runs the test. `matrix` contains Young's modulus (MPa), toughness (N/mm) and viscosity (MPa s) of the matrix.
    fn run(&self, matrix: [f64; 3], grains: &GrainList) -> Result<Run, Failure> {
        // quadratic elements follow curved surfaces with curved edges
        let curved = self.order == Order::Quadratic;
        let meshing = Meshing { mode: self.mode, curved, ..Meshing::new(self.spacing_mm) };
        let mesh = meshing.build(RADIUS_MM, HEIGHT_MM, grains)?.mesh;
        let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 44))
            .builder(mesh)?
            .order(self.order)
            .materials(materials(matrix))
            .homogenisation(self.rule)
            .phase_field(PhaseField::new(0.06))
            .build()?;
        let outcome = problem.run(&mut ());
        let quantities = measure(&outcome.curve);
        Ok(Run { quantities, unknowns: problem.unknowns(), effort: outcome.effort })
    }
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

/// Materials of the matrix and of grains that do not break.
fn materials([young_mpa, toughness_n_per_mm, viscosity_mpa_s]: [f64; 3]) -> [Material; 2] {
    let matrix = Material::hencky(young_mpa, 0.25).with_fracture(Fracture {
        toughness_n_per_mm,
        viscosity_mpa_s,
        residual_stiffness: 0.01,
    });
    [matrix, Material::hencky(22_000.0, 0.25)]
}

/// Returns slope (N/mm), peak force (N) and displacement at the peak (mm) of a curve; NaN if the force still rises at
/// the end.
///
/// The peak is the vertex of a parabola through the three highest points. The slope is the slope of the least-squares
/// line to the piecewise linear curve between 0.2 and 0.4 of the displacement at the peak.
fn measure(curve: &[CurvePoint]) -> [f64; 3] {
    let top = (0..curve.len())
        .max_by(|&a, &b| curve[a].force_n.total_cmp(&curve[b].force_n))
        .filter(|&top| top > 0 && top + 1 < curve.len());
    let Some(top) = top else { return [f64::NAN; 3] };
    let [a, b, c] = [top - 1, top, top + 1].map(|k| (curve[k].displacement_mm, curve[k].force_n));
    let h = b.0 - a.0;
    let (slope, bend) = ((c.1 - a.1) / (2.0 * h), (c.1 - 2.0 * b.1 + a.1) / (h * h));
    let (at, peak) = (b.0 - slope / bend, b.1 - 0.5 * slope * slope / bend);
    [slope_around(curve, 0.3 * at, 0.1 * at), peak, at]
}

/// Slope of the least-squares line to a piecewise linear curve on the window [c − L/2, c + L/2]:
/// 12/L³ ∫ (u − c) F du. The integral makes the slope a continuous function of the window.
fn slope_around(curve: &[CurvePoint], centre: f64, half: f64) -> f64 {
    let unloaded = [(-centre, 0.0)].into_iter();
    let centred_curve: Vec<(f64, f64)> =
        unloaded.chain(curve.iter().map(|p| (p.displacement_mm - centre, p.force_n))).collect();
    let moment: f64 = centred_curve
        .windows(2)
        .filter(|ends| ends[0].0 < half && ends[1].0 > -half)
        .map(|ends| {
            let ([a, b], rise) = ([ends[0].0, ends[1].0], ends[1].1 - ends[0].1);
            let force = |u: f64| ends[0].1 + rise * (u - a) / (b - a);
            let (from, to) = (a.max(-half), b.min(half));
            let middle = 0.5 * (from + to);
            // Simpson's rule, which is exact for a product of two linear functions
            let sum = from * force(from) + 4.0 * middle * force(middle) + to * force(to);
            (to - from) / 6.0 * sum
        })
        .sum();
    1.5 * moment / half.powi(3)
}
