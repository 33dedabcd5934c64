//! Advice for load steps that find no equilibrium.

use super::increment::Increments;
use crate::error::StepFailure;

/// If the largest damage of the body is below this value, damage is not the cause of the failure of a step.
const SOUND: f64 = 0.05;

/// Returns advice for a failure of a step from the current state.
pub(super) fn advice(increments: &Increments, failure: StepFailure) -> String {
    let Increments { setup, solver, state, .. } = increments;
    let damaged = &setup.discretisation.damaged;
    let materials = setup.definition.materials.iter().zip(damaged);
    let rate_independent = materials
        .filter(|(_, damaged)| **damaged)
        .any(|(m, _)| m.fracture.is_some_and(|f| f.viscosity_mpa_s == 0.0));
    let untouched = solver.newton.external.untouched(&state.fields);
    match failure {
        StepFailure::Condition => {
            "define the functions of the boundary conditions so that they return finite numbers over the whole schedule"
                .into()
        }
        StepFailure::NotFinite => {
            "end the test before the limit strain of the law, or check the parameters of the law"
                .into()
        }
        _ if failure.exceeds_limit_load() => "prescribe the displacement instead of the force".into(),
        StepFailure::GivenUp => "use a step controller that tries smaller steps".into(),
        _ if untouched.is_some() => format!(
            "no node of surface '{}' touches its platen, so that the body may be unsupported: let the platen \
             start at the surface, or support the body by other conditions",
            untouched.unwrap_or_default()
        ),
        StepFailure::Contact { .. } => {
            "use smaller steps, or a finer mesh at the platens".into()
        }
        _ if !damaged.contains(&true) || state.point.phi_max < SOUND => {
            let mut causes = "the body may buckle, snap through or rotate about a hinge, so that there is no \
                              equilibrium close to the last equilibrium: check the supports and the mesh (parts \
                              that are joined only by an edge or a node)"
                .to_owned();
            if !setup.definition.conditions.only_prescribe() {
                causes += ", prescribe displacements instead of loads";
            }
            causes + ", or allow smaller steps"
        }
        _ if rate_independent => {
            "damage without viscosity may grow unstably (snap back): set a viscosity, use arc-length steps, or \
             allow smaller steps"
                .into()
        }
        _ => "refine the mesh, increase the viscosity, or allow smaller steps".into(),
    }
}
