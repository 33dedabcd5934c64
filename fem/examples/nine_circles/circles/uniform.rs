//! Bodies without cracks under a uniform stress: fracture at the strength.
//!
//! Criterion: the largest stress is within 5 % of the strength surface of the material.

use std::error::Error;

use fem::{Axis, Block, Conditions, Outcome, Problem, Schedule, TetMesh};

use super::Verdict;
use super::law::{GLASS, Law, Solid};
use super::plate::tube;

const TOLERANCE: f64 = 0.05;
/// Number of load steps.
const STEPS: u32 = 200;

/// Runs a problem whose load is proportional to time until its force or torque falls.
fn problem(mesh: TetMesh, conditions: Conditions, law: Law) -> Result<Problem, Box<dyn Error>> {
    // without viscosity: uniform fields do not need it before the peak
    Ok(Problem::builder(mesh)
        .materials([GLASS.material(law, 0.0)])
        .phase_field(GLASS.phase_field(law))
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, STEPS).stop_below_peak(0.02))
        .build()?)
}

/// Largest strain of the load, as a multiple of the strain of an elastic body at its tensile strength.
const LARGEST: f64 = 2.2;

fn largest_force(outcome: &Outcome) -> f64 {
    outcome.curve.iter().map(|point| point.force_n.abs()).fold(0.0, f64::max)
}

fn verdict(value: f64, strength: f64, law: Law) -> Verdict {
    let reason = match law {
        Law::At1 | Law::At2 => "an energy at a point; its length is fitted to uniaxial tension",
        Law::Strength => "the strength surface is a property of the material",
    };
    Verdict::compare(value, "MPa", strength, TOLERANCE, reason.into())
}

/// Bar in uniaxial tension.
pub(crate) fn uniaxial(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let mesh = Block::new([1.0, 1.0, 3.0], [2, 2, 6]).build()?;
    let Solid { young_mpa, tensile_mpa, .. } = GLASS;
    let largest = 3.0 * LARGEST * tensile_mpa / young_mpa;
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, largest * time_s])
        .measure("top", [0.0, 0.0, 1.0]);
    let outcome = problem(mesh, conditions, law)?.run(&mut ());
    Ok(verdict(largest_force(&outcome), tensile_mpa, law))
}

/// Thin plate under equal tension in both directions.
pub(crate) fn biaxial(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let mesh = Block::new([2.0, 2.0, 0.25], [6, 6, 1]).build()?;
    let strength = GLASS.strength_factor([1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let largest = 2.0 * 0.6 * LARGEST * GLASS.tensile_mpa / GLASS.young_mpa;
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .fix("bottom", [Axis::Z])
        .prescribe("right", [Axis::X], move |_, time_s| [largest * time_s, 0.0, 0.0])
        .prescribe("back", [Axis::Y], move |_, time_s| [0.0, largest * time_s, 0.0])
        .measure("right", [1.0, 0.0, 0.0]);
    let outcome = problem(mesh, conditions, law)?.run(&mut ());
    Ok(verdict(largest_force(&outcome) / 0.5, strength, law))
}

/// Thin-walled tube in torsion; the value is the shear stress at its outer surface.
pub(crate) fn torsion(law: Law) -> Result<Verdict, Box<dyn Error>> {
    let (radii, length) = ([2.85, 3.0], 2.5);
    let mesh = tube(radii, length, [60, 8])?;
    let strength = GLASS.strength_factor([0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let shear_modulus = 0.5 * GLASS.young_mpa / (1.0 + GLASS.poisson);
    let largest = 0.62 * LARGEST * strength / shear_modulus * length / radii[1];
    let conditions = Conditions::new().fix("bottom", Axis::ALL).prescribe(
        "top",
        [Axis::X, Axis::Y],
        move |[x, y, _], time_s| {
            let (sine, cosine) = (largest * time_s).sin_cos();
            [x * cosine - y * sine - x, x * sine + y * cosine - y, 0.0]
        },
    );
    let problem = problem(mesh, conditions, law)?;
    let polar = 0.5 * std::f64::consts::PI * (radii[1].powi(4) - radii[0].powi(4));
    let (mut peak, mut run) = (0.0f64, problem.start());
    while run.step().is_some() {
        let state = problem.evaluate(run.fields())?;
        let torque = state.torque_n_mm("top", [0.0; 3], [0.0, 0.0, 1.0])?.abs();
        peak = peak.max(torque * radii[1] / polar);
        if torque * radii[1] / polar < 0.9 * peak {
            break;
        }
    }
    Ok(verdict(peak, strength, law))
}
