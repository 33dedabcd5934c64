//! Initial guess of an increment whose prescribed values jump.
//!
//! If the initial guess changed only the prescribed values, the elements at the surface would take the whole
//! deformation: they would invert, or distort so much that Newton's method needs many iterations. Instead, the whole
//! body moves by its linear response at the last equilibrium. The tangent of this response is reused in the first
//! iterations.

use super::linear::Nodal;
use super::newton::Newton;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Coupling, StepContext};

/// Relative residual of the linear solution. The elements at prescribed displacements dominate the residual, so that an
/// accurate response of all other elements needs a smaller tolerance than a Newton iteration.
const LINEAR_TOLERANCE: f64 = 1e-4;
/// Step of the finite difference that gives the derivative of the residual with respect to the prescribed values, as a
/// fraction of the increment.
const NUDGE: f64 = 1e-6;

/// Returns the previous equilibrium `before` plus its linear response to the loads and the prescribed values of this
/// increment. The fields `placed` contain these prescribed values.
///
/// The tangent remains stored for the next iteration.
pub(super) fn predict(
    newton: &mut Newton,
    coupling: Coupling,
    before: &Fields,
    placed: &Fields,
    context: StepContext,
) -> Result<Fields, StepFailure> {
    // returns `before` with the prescribed values moved towards their values in `placed` by a fraction of the
    // difference
    let moved_by = |fraction: f64| {
        let mut moved = before.clone();
        moved.platen_mm += fraction * (placed.platen_mm - before.platen_mm);
        for (n, unknown) in newton.unknown.iter().enumerate() {
            for k in (0..3).filter(|&k| !unknown[k]) {
                let step = placed.displacement[n][k] - before.displacement[n][k];
                moved.displacement[n][k] += fraction * step;
            }
            if !unknown[3] {
                moved.damage[n] += fraction * (placed.damage[n] - before.damage[n]);
            }
        }
        moved
    };
    let (nudged, mut predicted) = (moved_by(NUDGE), moved_by(1.0));
    newton.evaluate(&nudged, context)?;
    let nudged = newton.residual.nodal.clone();
    newton.begin(&mut before.clone(), context)?;
    newton.linearise_as(coupling, before, context)?;
    let border = nudged.iter().zip(&newton.residual.nodal);
    let right: Vec<Nodal> = border
        .map(|(nudged, at)| std::array::from_fn(|k| at[k] + (nudged[k] - at[k]) / NUDGE))
        .collect();
    newton.effort.iterations += 1;
    let tolerance = LINEAR_TOLERANCE.min(newton.settings.linear_tolerance);
    let step = newton.solve_nodal(&right, tolerance)?;
    for (n, step) in step.iter().enumerate() {
        for k in (0..3).filter(|&k| newton.free[n][k]) {
            predicted.displacement[n][k] -= step[k];
        }
        if newton.free[n][3] {
            predicted.damage[n] -= step[3];
        }
    }
    // returns an error if the residual cannot be evaluated at the prediction
    newton.begin(&mut predicted, context)?;
    Ok(predicted)
}
