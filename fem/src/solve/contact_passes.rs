//! Iteration over the contact pressures of an increment (augmented Lagrangian method); one iteration is a *pass*.
//!
//! A pass solves for the fields at given pressures and then updates the pressures from the gaps. The change of the
//! contact forces measures the distance to an equilibrium with consistent pressures, so the residual and this change
//! have the same tolerance. The change cannot fall below the error of the previous solution. Therefore, the tolerance
//! of each solution is a tenth of the previous change, and at least a tenth of the final tolerance.

use super::newton::Newton;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// Largest number of passes per increment. A pass solves for the fields at fixed contact pressures, and then updates
/// the pressures.
const PASSES: u32 = 60;
/// Tolerance of the solution in a pass, as a fraction of the change of the contact forces in the previous pass. The
/// last pass uses this fraction of the final tolerance.
const MARGIN: f64 = 0.1;
/// Tolerance of the solution in the first pass, as the residual divided by the reactions.
const FIRST: f64 = 1e-3;
/// If an increment with friction fails, it is solved with these multiples of the specified slip velocity, one after the
/// other. A larger slip velocity makes the transition from stick to slip smoother, so that Newton's method converges
/// from a worse initial guess.
const ONSET: [f64; 3] = [100.0, 10.0, 1.0];

/// Solves for the fields at fixed contact pressures, from a guess, and returns the number of iterations.
pub(super) type SolveFields<'s> =
    dyn FnMut(&mut Newton, &mut Fields, StepContext) -> Result<u32, StepFailure> + 's;

/// Solves one increment with contact; `solve` solves for the fields at fixed pressures. Returns the number of
/// iterations.
pub(super) fn equilibrium(
    newton: &mut Newton,
    fields: &mut Fields,
    context: StepContext,
    solve: &mut SolveFields,
) -> Result<u32, StepFailure> {
    if !newton.external.has_friction() {
        return settle(newton, fields, context, solve);
    }
    let start = (fields.clone(), newton.external.clone());
    let settled = settle(newton, fields, context, solve);
    if settled.is_ok() {
        return settled;
    }
    newton.effort.fallbacks += 1;
    (*fields, newton.external) = start;
    let mut iterations = 0;
    for bluntness in ONSET {
        newton.external.blunt(bluntness);
        iterations += settle(newton, fields, context, solve)?;
    }
    Ok(iterations)
}

/// Repeats passes until the contact pressures are consistent with the gaps.
fn settle(
    newton: &mut Newton,
    fields: &mut Fields,
    context: StepContext,
    solve: &mut SolveFields,
) -> Result<u32, StepFailure> {
    if !newton.external.has_contact() {
        return solve(newton, fields, context);
    }
    let tolerance = newton.settings.tolerance;
    let settled = passes(newton, fields, context, solve);
    newton.settings.tolerance = tolerance;
    settled
}

/// Repeats passes like [`settle`], and changes the tolerance of Newton's method, which the caller must restore.
fn passes(
    newton: &mut Newton,
    fields: &mut Fields,
    context: StepContext,
    solve: &mut SolveFields,
) -> Result<u32, StepFailure> {
    let tolerance = newton.settings.tolerance;
    let least = MARGIN * tolerance;
    let (mut iterations, mut exact, mut change) = (0, FIRST.max(least), f64::INFINITY);
    for _ in 0..PASSES {
        newton.settings.tolerance = exact;
        iterations += solve(newton, fields, context)?;
        change = newton.external.augment(fields).sqrt() / newton.scale_of_forces();
        if change <= tolerance && exact <= least {
            return Ok(iterations);
        }
        exact = (MARGIN * change).clamp(least, exact);
    }
    Err(StepFailure::Contact { passes: PASSES, change })
}
