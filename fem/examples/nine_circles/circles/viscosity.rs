//! J-integral of a crack that grows with a viscous phase field.

use std::error::Error;

use fem::{Axis, Problem, Schedule};

use super::growth::grow;
use super::law::{GLASS, Law, SPACING, Solid};
use super::plate::HalfPlate;

/// Number of steps of 1 s.
const STEPS: u32 = 15;

/// Prints, for AT1 and AT2 and several viscosities, the speed of the crack and its J-integral along the run.
///
/// The opening of the plate decreases along the crack, so that the crack grows stably. The toughness is not divided by the
/// factor of the mesh.
pub(crate) fn print_table() -> Result<(), Box<dyn Error>> {
    println!(
        "| law | ξ (MPa s) | ξ ℓ₀/(Gc s) | speed (ℓ₀/s) | J/Gc | crack energy/Gc | viscous/Gc | balance/J |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for law in [Law::At1, Law::At2] {
        for relative in [0.003, 0.03, 0.1, 0.3] {
            print_row(law, relative)?;
        }
    }
    Ok(())
}

fn print_row(law: Law, relative: f64) -> Result<(), Box<dyn Error>> {
    const LENGTH: f64 = 0.15;
    let Solid { young_mpa, poisson, toughness_n_per_mm, .. } = GLASS;
    let (width, half, tip) = (16.0, 2.5, 5.0);
    let plate = HalfPlate {
        width_mm: width,
        height_mm: half,
        tip_mm: tip,
        size_mm: SPACING * LENGTH,
        fine_mm: [0.3, 2.0, 0.45],
        largest_mm: f64::INFINITY,
    };
    let modulus = young_mpa / (1.0 - poisson * poisson);
    let critical = (half * toughness_n_per_mm / modulus).sqrt();
    // at x, the opening is the critical opening of a uniform strip once the time reaches a multiple of (x − tip)
    let opening = move |time_s: f64| {
        let slope = 0.024;
        critical / (1.0 - tip / width) * (0.9 * time_s.min(1.0) + slope * (time_s - 1.0).max(0.0))
    };
    let conditions = plate
        .conditions(true)
        .prescribe("top", [Axis::X, Axis::Z], move |[x, ..], time_s| {
            [0.0, 0.0, opening(time_s) * (1.0 - x / width)]
        })
        .measure("top", [0.0, 0.0, 1.0]);
    let viscosity = relative * toughness_n_per_mm / LENGTH;
    let mut material = GLASS.material(law, viscosity);
    if let Some(fracture) = &mut material.fracture {
        fracture.toughness_n_per_mm = toughness_n_per_mm;
    }
    let field = fem::PhaseField { length_mm: LENGTH, ..GLASS.phase_field(law) };
    let problem = Problem::builder(plate.mesh()?)
        .materials([material])
        .phase_field(field)
        .conditions(conditions)
        .schedule(Schedule::fixed(f64::from(STEPS), STEPS))
        .build()?;
    let grown = grow(&plate, &problem, f64::INFINITY)?;
    // mean over the last third of the run, in which the crack grows at a constant speed
    let (first, last) = (STEPS as usize * 2 / 3, STEPS as usize);
    let count = (last - first) as f64;
    let mean = |k: usize| {
        grown[first..last].iter().map(|g| g.balance_n_per_mm[k]).sum::<f64>()
            / count
            / toughness_n_per_mm
    };
    let [elastic, crack, viscous] = [0, 1, 2].map(mean);
    let speed = (grown[last - 1].tip_mm - grown[first - 1].tip_mm) / count / LENGTH;
    println!(
        "| {} | {viscosity:.1e} | {relative} | {speed:.2} | {elastic:.3} | {crack:.3} | {viscous:.3} | {:.3} |",
        law.name(),
        (crack + viscous) / elastic
    );
    Ok(())
}
