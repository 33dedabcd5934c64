//! Bodies with a long crack: growth at the toughness (Griffith).
//!
//! Criterion: the energy release rate at which the crack grows, from the closed form of the body, is within 10 % of Gc.

use std::error::Error;

use fem::{Axis, Conditions, NodeSet, Problem, Schedule, TetMesh};

use super::Verdict;
use super::law::{GLASS, Law, Solid};
use super::plate::{HalfPlate, ROUNDING};

const TOLERANCE: f64 = 0.1;
/// The crack counts as grown where the damage exceeds this value.
const BROKEN: f64 = 0.9;
/// Largest number of load steps.
const MOST_STEPS: u32 = 40;

/// State of a growing crack.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grown {
    /// Number of the step, which is also the time in s.
    pub(crate) step: f64,
    /// Position of the crack tip, mm.
    pub(crate) tip_mm: f64,
    /// Force on the measured surface per thickness, N/mm.
    pub(crate) force_n_per_mm: f64,
    /// J-integral, crack energy per length and viscous resistance of the whole plate, N/mm.
    pub(crate) balance_n_per_mm: [f64; 3],
}

/// Returns the position of the crack tip, mm: the end of the damaged part of the crack plane.
pub(crate) fn tip(mesh: &TetMesh, damage: &[f64]) -> f64 {
    let nodes = mesh.nodes.iter().zip(damage);
    let broken = nodes.filter(|(x, phi)| x[2] < ROUNDING && **phi > BROKEN).map(|(x, _)| x[0]);
    broken.fold(0.0, f64::max)
}

/// Runs a plate until its crack has grown by `growth_mm`, or to the end of the load. Steps last 1 s.
pub(crate) fn grow(
    plate: &HalfPlate,
    problem: &Problem,
    growth_mm: f64,
) -> Result<Vec<Grown>, Box<dyn Error>> {
    let (mesh, front) = (plate.mesh()?, plate.size_mm);
    // q = 1 around the crack, zero at the ends of the plate and at its loaded upper side
    let room = 0.25 * plate.tip_mm;
    let ahead = plate.tip_mm + plate.fine_mm[1];
    let q = |[x, _, z]: [f64; 3]| {
        let ramp = |distance: f64| (1.0 - distance / room).clamp(0.0, 1.0);
        let up = (1.8 - 2.0 * z / plate.height_mm).clamp(0.0, 1.0);
        [ramp(x - ahead) * ramp(plate.tip_mm - room - x) * up, 0.0, 0.0]
    };
    let mut run = problem.start();
    let mut before = run.fields().clone();
    let mut grown = Vec::new();
    while let Some(point) = run.step() {
        let state = problem.evaluate(run.fields())?;
        let balance = [
            state.energy_release_n(q)?,
            state.crack_resistance_n(q),
            state.viscous_resistance_n(&before, 1.0, q)?,
        ];
        let tip_mm = tip(&mesh, &run.fields().damage);
        if std::env::var_os("PROGRESS").is_some() {
            eprintln!(
                "{:.0} s, tip {tip_mm:.4} mm, {balance:?}, residual {:.1e}, {:?}",
                point.time_s,
                point.residual,
                run.effort()
            );
        }
        grown.push(Grown {
            step: point.time_s,
            tip_mm,
            force_n_per_mm: point.force_n / front,
            balance_n_per_mm: balance.map(|n| 2.0 * n / front),
        });
        if tip_mm > plate.tip_mm + growth_mm {
            return Ok(grown);
        }
        before = run.fields().clone();
    }
    Ok(grown)
}

/// Energy release rate of the load at a step, as a multiple of Gc: first step 0.84, then rising by 0.02 per step.
fn load_factor(step: f64) -> f64 {
    0.84 * step.min(1.0) + 0.02 * (step - 1.0).max(0.0)
}

fn problem(plate: &HalfPlate, law: Law, conditions: Conditions) -> Result<Problem, Box<dyn Error>> {
    Ok(Problem::builder(plate.mesh()?)
        .materials([GLASS.material(law, GLASS.viscosity_mpa_s(law))])
        .phase_field(GLASS.phase_field(law))
        .conditions(conditions)
        .schedule(Schedule::fixed(f64::from(MOST_STEPS), MOST_STEPS))
        .build()?)
}

fn verdict(release: f64, grown: &Grown, plate: &HalfPlate, law: Law) -> Verdict {
    let toughness = GLASS.toughness_n_per_mm;
    let [elastic, crack, viscous] = grown.balance_n_per_mm.map(|n| n / toughness);
    let has_grown = grown.tip_mm > plate.tip_mm + GLASS.length_mm(law);
    let reason = if has_grown {
        format!("J {elastic:.3} Gc, crack energy {crack:.3} Gc, viscous {viscous:.3} Gc")
    } else {
        format!("no growth until J = {elastic:.2} Gc")
    };
    let verdict = Verdict::compare(release, "N/mm", toughness, TOLERANCE, reason);
    Verdict { passed: verdict.passed && has_grown, ..verdict }
}

fn plate(law: Law, width_mm: f64, height_mm: f64, tip_mm: f64) -> HalfPlate {
    let length = GLASS.length_mm(law);
    HalfPlate {
        width_mm,
        height_mm,
        tip_mm,
        size_mm: GLASS.spacing_mm(law),
        fine_mm: [1.5 * length, 5.0 * length, 3.0 * length],
        largest_mm: f64::INFINITY,
    }
}

/// Clamped strip with a long crack: the energy release rate is the height times the energy density far ahead of the crack.
pub(crate) fn pure_shear(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let (half, tip) = (2.5, 8.0);
    let plate = plate(law, 18.0, half, tip);
    let Solid { young_mpa, poisson, toughness_n_per_mm, .. } = GLASS;
    let modulus = young_mpa / (1.0 - poisson * poisson);
    let critical = (half * toughness_n_per_mm / modulus).sqrt();
    let conditions = plate
        .conditions(true)
        .prescribe("top", [Axis::X, Axis::Z], move |_, time_s| {
            [0.0, 0.0, critical * load_factor(time_s).sqrt()]
        })
        .measure("top", [0.0, 0.0, 1.0]);
    let grown = grow(&plate, &problem(&plate, law, conditions)?, 2.0 * GLASS.length_mm(law))?;
    let last = grown.last().ok_or("no step")?;
    Ok(verdict(toughness_n_per_mm * load_factor(last.step), last, &plate, law))
}

/// Double cantilever beam; the energy release rate follows from the force, with the stress intensity of Wiederhorn, Shorb &
/// Moses (J. Appl. Phys. 39 (1968) 1572).
pub(crate) fn double_cantilever(law: Law) -> Result<Verdict, Box<dyn Error>> {
    // the damaged band at the crack, some ℓ₀ wide, makes the arms thinner: they must be much higher than ℓ₀
    let (width, arm, tip) = (48.0f64, 8.0f64, 24.0f64);
    // small elements in the arms, which bend
    let plate = HalfPlate { largest_mm: 0.1 * arm, ..plate(law, width, arm, tip) };
    let Solid { young_mpa, toughness_n_per_mm, .. } = GLASS;
    let intensity =
        move |force: f64, crack: f64| force * (3.467 * crack + 2.315 * arm) / arm.powf(1.5);
    let force = (young_mpa * toughness_n_per_mm).sqrt() / intensity(1.0, tip);
    let critical = 4.0 * force * (tip + 0.64 * arm).powi(3) / (young_mpa * arm.powi(3));
    let conditions = plate
        .conditions(true)
        .node_set("end", NodeSet::matching(|[x, ..]| x < ROUNDING))
        .node_set(
            "corner",
            NodeSet::matching(move |[x, _, z]| x > width - ROUNDING && z < ROUNDING),
        )
        .fix("corner", [Axis::X])
        .prescribe("end", [Axis::Z], move |_, time_s| {
            [0.0, 0.0, critical * load_factor(time_s).sqrt()]
        })
        .measure("end", [0.0, 0.0, 1.0]);
    let grown = grow(&plate, &problem(&plate, law, conditions)?, 3.0 * GLASS.length_mm(law))?;
    let last = grown.last().ok_or("no step")?;
    let release = intensity(last.force_n_per_mm, last.tip_mm).powi(2) / young_mpa;
    Ok(verdict(release, last, &plate, law))
}

/// Trousers test with legs that are held straight: anti-plane shear (mode III). The energy release rate is the height times the
/// energy density far ahead of the crack.
pub(crate) fn trousers(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let (half, tip) = (2.5, 8.0);
    let plate = plate(law, 18.0, half, tip);
    let Solid { young_mpa, poisson, toughness_n_per_mm, .. } = GLASS;
    let shear_modulus = 0.5 * young_mpa / (1.0 + poisson);
    let critical = (half * toughness_n_per_mm / shear_modulus).sqrt();
    let conditions = Conditions::new()
        .node_set("all", NodeSet::matching(|_| true))
        .node_set("ligament", plate.ligament())
        .node_set("crack", plate.crack())
        .fix("all", [Axis::X, Axis::Z])
        .fix("ligament", [Axis::Y])
        .prescribe_damage("crack", |_, _| 1.0)
        .prescribe("top", [Axis::Y], move |_, time_s| {
            [0.0, critical * load_factor(time_s).sqrt(), 0.0]
        })
        .measure("top", [0.0, 1.0, 0.0]);
    let grown = grow(&plate, &problem(&plate, law, conditions)?, 2.0 * GLASS.length_mm(law))?;
    let last = grown.last().ok_or("no step")?;
    Ok(verdict(toughness_n_per_mm * load_factor(last.step), last, &plate, law))
}
