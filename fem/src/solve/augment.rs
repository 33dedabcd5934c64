//! Passes over the contact pressures of an increment.
//!
//! A pass solves for the fields at given pressures and then updates the pressures from the gaps. The change of the
//! contact forces measures the distance to an equilibrium with consistent pressures, so it has the same tolerance as
//! the residual. The change cannot fall below the error of the previous solution: the tolerance of each solution is a
//! tenth of the previous change, and that of the last solution is a tenth of the final tolerance.

use super::external::External;
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

const PASSES: u32 = 60;
/// Tolerance of a solution, as a fraction of the previous change of the contact forces; for the last solution, as a
/// fraction of the final tolerance.
const MARGIN: f64 = 0.1;
/// Residual of the first solution, relative to the reactions.
const FIRST: f64 = 1e-3;
/// Slip velocities, as multiples of the specified one, that are used sequentially if the increment fails with the
/// specified one. The sharper the transition from stick to slip, the closer to the solution must Newton's method
/// start.
const ONSET: [f64; 3] = [100.0, 10.0, 1.0];

impl<E: External> Solver<'_, E> {
    /// Solves one increment with contact. Returns the number of iterations.
    pub(crate) fn equilibrium(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<u32, StepFailure> {
        if !self.external.has_friction() {
            return self.settle(fields, context);
        }
        let start = (fields.clone(), self.external.clone());
        let settled = self.settle(fields, context);
        if settled.is_ok() {
            return settled;
        }
        self.effort.fallbacks += 1;
        (*fields, self.external) = start;
        let mut iterations = 0;
        for bluntness in ONSET {
            self.external.blunt(bluntness);
            iterations += self.settle(fields, context)?;
        }
        Ok(iterations)
    }

    /// Repeats passes over the pressures until the pressures are consistent with the gaps.
    fn settle(&mut self, fields: &mut Fields, context: StepContext) -> Result<u32, StepFailure> {
        if !self.external.has_contact() {
            return self.solve(fields, context);
        }
        let tolerance = self.options.tolerance;
        let settled = self.passes(fields, context, tolerance);
        self.options.tolerance = tolerance;
        settled
    }

    fn passes(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
        tolerance: f64,
    ) -> Result<u32, StepFailure> {
        let least = MARGIN * tolerance;
        let (mut iterations, mut exact) = (0, FIRST.max(least));
        for _ in 0..PASSES {
            self.options.tolerance = exact;
            iterations += self.solve(fields, context)?;
            let change = self.external.augment(fields).sqrt() / self.scale_of_forces();
            if change <= tolerance && exact <= least {
                return Ok(iterations);
            }
            exact = (MARGIN * change).clamp(least, exact);
        }
        Err(StepFailure::Contact)
    }
}
