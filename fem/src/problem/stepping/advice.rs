//! Advice for load steps without equilibrium.

use super::increment::Increments;
use crate::error::StepFailure;

/// A body whose largest damage is below this value counts as undamaged, so that damage is not the cause of the
/// failure.
const SOUND: f64 = 0.05;

/// Returns advice for a failure of a step from the current state.
pub(super) fn advice(increments: &Increments, failure: StepFailure) -> String {
    let Increments { setup, solver, state } = increments;
    let damaged = &setup.discretisation.damaged;
    let materials = setup.parts.materials.iter().zip(damaged);
    let rate_independent = materials
        .filter(|(_, damaged)| **damaged)
        .any(|(m, _)| m.fracture.is_some_and(|f| f.viscosity_mpa_s == 0.0));
    let untouched = solver.newton.external.untouched(&state.fields);
    match failure {
        StepFailure::Condition => {
            "let the functions of the conditions return finite numbers over the whole schedule"
                .into()
        }
        StepFailure::NotFinite => {
            "end the test before the law's limit, or check the law's parameters".into()
        }
        StepFailure::GivenUp => "let the step controller try smaller steps".into(),
        _ if untouched.is_some() => format!(
            "no node of surface '{}' touches its platen, so that nothing may hold the body: let the platen \
             start at the surface, or hold the body by other conditions",
            untouched.unwrap_or_default()
        ),
        StepFailure::Contact { .. } => {
            "take smaller steps, or a finer mesh where the platens press".into()
        }
        _ if !damaged.contains(&true) || state.point.phi_max < SOUND => {
            let mut causes = "the body may buckle, snap through or turn about a hinge, where a load or a \
                              displacement has no equilibrium near by: check supports and mesh (parts joined \
                              by an edge or a node alone)"
                .to_owned();
            if !setup.parts.conditions.only_prescribe() {
                causes += ", prescribe displacements in place of loads";
            }
            causes + ", or allow smaller steps"
        }
        _ if rate_independent => {
            "damage without viscosity may run on by itself: give it a viscosity, take arc-length steps, or \
             allow smaller steps"
                .into()
        }
        _ => "refine the mesh, raise the viscosity, or allow smaller steps".into(),
    }
}
