//! Cracks that begin under a non-uniform stress: strength and toughness together decide.

use std::error::Error;

use fem::{Axis, Block, Conditions, Material, NodeSet, Order, Problem, Schedule, TetMesh};

use super::Verdict;
use super::growth::tip;
use super::law::{ELASTOMER, GLASS, Law, SPACING, Solid};
use super::plate::{HalfPlate, ROUNDING, around, graded, merged};

/// A point counts as broken where the damage exceeds this value.
const BROKEN: f64 = 0.9;
/// Largest number of load steps of 1 s.
const MOST_STEPS: u32 = 80;

/// Load at a step, as a multiple of a reference load: first step 0.5, then rising by 0.02 per step.
fn load_factor(step: f64) -> f64 {
    0.5 * step.min(1.0) + 0.02 * (step - 1.0).max(0.0)
}

/// Thin plate with an edge notch of several depths, in tension.
///
/// Criterion, for every depth: the strength of the plate is at most 5 % above the tensile strength and above Griffith's
/// strength, and at most 10 % below the interpolation (σ_ts⁻² + σ_G⁻²)^(−1/2).
pub(crate) fn edge_notch(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let mut reason = Vec::new();
    let (mut value, mut reference, mut passed) = (0.0, 0.0, true);
    for (k, notch) in [0.05, 0.2, 0.6].into_iter().enumerate() {
        let (stress, [lower, upper]) = notched_strength(law, notch)?;
        let is_within = stress <= 1.05 * upper && stress >= 0.9 * lower;
        passed &= is_within;
        let mark = if is_within { "" } else { ", outside" };
        reason.push(format!("{notch} mm: {stress:.1} ({lower:.1} to {upper:.1}{mark})"));
        if k == 1 {
            (value, reference) = (stress, upper);
        }
    }
    Ok(Verdict { value, unit: "MPa", reference, passed, reason: reason.join("; ") })
}

/// Returns the strength of a notched plate and its bounds, MPa.
fn notched_strength(law: Law, notch: f64) -> Result<(f64, [f64; 2]), Box<dyn Error>> {
    // the length of AT1 is not small against the notches: linear elements of a third of it would be too coarse for them
    let spacing = if law == Law::At1 { SPACING / 2.0 } else { SPACING };
    let solid = Solid { spacing, ..GLASS };
    let Solid { young_mpa, toughness_n_per_mm, tensile_mpa, .. } = solid;
    let (width, half) = (10.0, 8.0);
    let shape = 1.12 - 0.231 * (notch / width) + 10.55 * (notch / width).powi(2);
    let griffith = (young_mpa * toughness_n_per_mm / (std::f64::consts::PI * notch)).sqrt() / shape;
    let upper = griffith.min(tensile_mpa);
    let lower = 1.0 / (griffith.powi(-2) + tensile_mpa.powi(-2)).sqrt();
    let length = solid.length_mm(law);
    let plate = HalfPlate {
        width_mm: width,
        height_mm: half,
        tip_mm: notch,
        size_mm: solid.spacing_mm(law),
        fine_mm: [4.0 * length, 6.0 * length, 4.0 * length],
        largest_mm: f64::INFINITY,
    };
    let elastic = upper / young_mpa * half;
    let conditions = plate
        .conditions(false)
        .node_set(
            "corner",
            NodeSet::matching(move |[x, _, z]| x > width - ROUNDING && z < ROUNDING),
        )
        .fix("corner", [Axis::X])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, elastic * load_factor(time_s)])
        .measure("top", [0.0, 0.0, 1.0]);
    let problem = Problem::builder(plate.mesh()?)
        .materials([solid.material(law, solid.viscosity_mpa_s(law))])
        .phase_field(solid.phase_field(law))
        .conditions(conditions)
        .schedule(Schedule::fixed(f64::from(MOST_STEPS), MOST_STEPS).stop_below_peak(0.05))
        .build()?;
    let mesh = plate.mesh()?;
    let mut run = problem.start();
    let mut peak = 0.0f64;
    while let Some(point) = run.step() {
        peak = peak.max(point.force_n);
        // the plate breaks once the crack has left the notch
        if tip(&mesh, &run.fields().damage) > notch + 2.0 * length {
            break;
        }
        if std::env::var_os("PROGRESS").is_some() {
            let stress = point.force_n / (width * plate.size_mm);
            eprintln!("{notch} mm: {stress:.2} MPa, φ {:.3} {:?}", point.phi_max, run.effort());
        }
    }
    Ok((peak / (width * plate.size_mm), [lower, upper]))
}

/// Poker chip: a thin layer of an elastomer between rigid plates (plane strain) that are pulled apart.
///
/// Criterion: the crack begins inside the layer, farther than half the thickness from its free edge, at a mean stress that is not
/// below the stress at which the middle of the elastic layer reaches the strength surface (5 % tolerance), and not above
/// Griffith's stress of a long layer.
pub(crate) fn poker_chip(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let Solid { young_mpa, poisson, toughness_n_per_mm, .. } = ELASTOMER;
    let (width, half) = (3.0, 0.5);
    // quadratic elements have two node spacings per element
    let size = 2.0 * ELASTOMER.spacing_mm(law);
    let cells = |length: f64| (length / size).round().max(1.0) as usize;
    let mesh = Block::new([width, size, half], [cells(width), 1, cells(half)]).build()?;
    let modulus = young_mpa * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let griffith = (2.0 * modulus * toughness_n_per_mm / (2.0 * half)).sqrt();
    let area = width * size;
    let problem = |material: Material, steps: u32, opening_mm: f64| {
        let conditions = Conditions::new()
            .symmetry("left")
            .fix("front", [Axis::Y])
            .fix("back", [Axis::Y])
            .fix("bottom", [Axis::Z])
            .prescribe("top", [Axis::X, Axis::Z], move |_, time_s| {
                [0.0, 0.0, opening_mm * (0.5 * time_s.min(1.0) + 0.04 * (time_s - 1.0).max(0.0))]
            })
            .measure("top", [0.0, 0.0, 1.0]);
        Problem::builder(mesh.clone())
            .order(Order::Quadratic)
            .materials([material])
            .phase_field(ELASTOMER.phase_field(law))
            .conditions(conditions)
            .schedule(Schedule::fixed(f64::from(steps), steps))
            .build()
    };
    // small opening of an elastic layer, and the opening at which its middle reaches the strength surface
    let trial = 1e-4 * half;
    let elastic = problem(Material::hencky(young_mpa, poisson), 1, 2.0 * trial)?;
    let mut run = elastic.start();
    let point = run.step().ok_or("no elastic step")?;
    let stress = elastic.evaluate(run.fields())?.elements()?[0].stress_mpa;
    let factor = ELASTOMER.strength_factor(stress);
    let strength = factor * point.force_n / area;
    let material = ELASTOMER.material(law, ELASTOMER.viscosity_mpa_s(law));
    let broken = problem(material, MOST_STEPS, factor * trial)?;
    let mut run = broken.start();
    let mut peak = 0.0f64;
    let mut start = None;
    while let Some(point) = run.step() {
        peak = peak.max(point.force_n / area);
        start = most_damaged(&mesh, &run.fields().damage);
        if std::env::var_os("PROGRESS").is_some() {
            let stress = point.force_n / area;
            eprintln!("{stress:.4} MPa, {start:?}, φ {:.3} {:?}", point.phi_max, run.effort());
        }
        if start.is_some() {
            break;
        }
    }
    if start.is_none() {
        let reason = format!("no crack: {:?}", run.finish().end);
        return Ok(Verdict {
            value: peak,
            unit: "MPa",
            reference: strength,
            passed: false,
            reason,
        });
    }
    let [x, _, z] = start.unwrap_or([f64::NAN; 3]);
    let passed = peak >= 0.95 * strength && peak <= griffith && x < width - half;
    let reason = format!(
        "begins at {x:.2} mm of {width} mm, {z:.2} mm of {half} mm; Griffith {griffith:.2} MPa"
    );
    Ok(Verdict { value: peak, unit: "MPa", reference: strength, passed, reason })
}

/// Returns the position of the largest damage at the vertices of the mesh if a point is broken.
fn most_damaged(mesh: &TetMesh, damage: &[f64]) -> Option<[f64; 3]> {
    let nodes = mesh.nodes.iter().zip(damage);
    let (x, phi) = nodes.max_by(|a, b| a.1.total_cmp(b.1))?;
    (*phi > BROKEN).then_some(*x)
}

/// Radius of the punch, mm.
const PUNCH: f64 = 1.0;

/// Quarter of a glass body below the flat end of a cylindrical punch without friction.
///
/// Criterion: a ring crack begins at the surface outside the contact, at 1 to 1.5 radii of the punch, while the glass under the
/// punch, which is compressed, is not broken.
pub(crate) fn indentation(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let solid = Solid { length_share: 0.5, ..GLASS };
    let (length, far) = (solid.length_mm(law), 8.0);
    let size = solid.spacing_mm(law).max(0.02);
    let radii = around(PUNCH, [0.0, far], size, [2.0 * length, 4.0 * length], far);
    let mut depths: Vec<f64> = graded(size, 3.0 * length, far, far).iter().map(|z| -z).collect();
    depths.reverse();
    let angles: Vec<f64> = (0..=3).map(|k| std::f64::consts::FRAC_PI_6 * f64::from(k)).collect();
    let block = Block { planes_mm: [radii, angles, depths], ..Block::new([1.0; 3], [1; 3]) };
    let bent = block.build()?.mapped(|[r, angle, z]| [r * angle.cos(), r * angle.sin(), z]);
    let mesh = merged(bent).with_surfaces(|_, normal| {
        let towards = |axis: usize| normal[axis] < -1.0 + 1e-6;
        ["left", "front", "bottom"]
            .into_iter()
            .enumerate()
            .find(|(k, _)| towards(*k))
            .map(|(_, n)| n)
    });
    let Solid { young_mpa, poisson, tensile_mpa, .. } = solid;
    // depth at which an elastic body carries 10 times the tensile strength as mean pressure (Boussinesq)
    let depth =
        10.0 * tensile_mpa * std::f64::consts::FRAC_PI_2 * PUNCH * (1.0 - poisson * poisson)
            / young_mpa;
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .fix("bottom", [Axis::Z])
        .node_set(
            "punch",
            NodeSet::matching(|[x, y, z]| {
                z > -ROUNDING && x * x + y * y < (PUNCH + ROUNDING).powi(2)
            }),
        )
        .prescribe("punch", [Axis::Z], move |_, time_s| {
            [0.0, 0.0, -4.0 * depth * time_s / f64::from(MOST_STEPS)]
        })
        .measure("punch", [0.0, 0.0, -1.0]);
    let problem = Problem::builder(mesh.clone())
        .materials([solid.material(law, solid.viscosity_mpa_s(law))])
        .phase_field(solid.phase_field(law))
        .conditions(conditions)
        .schedule(Schedule::fixed(f64::from(MOST_STEPS), MOST_STEPS / 2))
        .build()?;
    let mut run = problem.start();
    let mut force = 0.0;
    let mut start = None;
    while let Some(point) = run.step() {
        force = point.force_n;
        if std::env::var_os("PROGRESS").is_some() {
            eprintln!("{force:.2} N, φ {:.3} {:?}", point.phi_max, run.effort());
        }
        start = most_damaged(&mesh, &run.fields().damage);
        if start.is_some() {
            break;
        }
    }
    let under = mesh
        .nodes
        .iter()
        .zip(&run.fields().damage)
        .filter(|([x, y, z], _)| x.hypot(*y) < PUNCH - length.min(0.3) && *z > -3.0 * length);
    let crushed = under.map(|(_, phi)| *phi).fold(0.0, f64::max);
    let radius = start.map_or(f64::NAN, |[x, y, _]| x.hypot(y));
    let passed = (1.0 - ROUNDING..=1.5).contains(&(radius / PUNCH)) && crushed < 0.5;
    let pressure = 4.0 * force / (std::f64::consts::PI * PUNCH * PUNCH);
    let reason = format!("mean pressure {pressure:.0} MPa; damage under the punch {crushed:.2}");
    Ok(Verdict { value: radius, unit: "mm", reference: PUNCH, passed, reason })
}
