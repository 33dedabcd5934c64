//! Passes over the contact pressures of an increment.
//!
//! A pass solves for the fields at given pressures and then gives the pressures the values that the gaps ask for. The
//! change of the contact forces is what the equilibrium with consistent pressures still lacks, so that it is held to the
//! same tolerance as the residual. It can fall no lower than what the solution before it has left: each solution is
//! a tenth as exact as the change before, and the last one a tenth as the tolerance.

use super::external::External;
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

const PASSES: u32 = 60;
/// Residual of a solution over the change of the contact forces that came before it, or over the one that ends the
/// passes.
const MARGIN: f64 = 0.1;
/// Residual of the first solution, relative to the reactions.
const FIRST: f64 = 1e-3;
/// Slip velocities, as multiples of the one asked for, by which friction sets in where it would not at
/// once: the sharper the change from stick to slip, the nearer must Newton's method start.
const ONSET: [f64; 3] = [100.0, 10.0, 1.0];

impl<E: External> Solver<'_, E> {
    /// Solves one increment with its contact; returns the iterations it took.
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

    /// Passes over the pressures until they agree with the gaps.
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
