//! Passes over the contact pressures of an increment.

use super::external::External;
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// Change of the contact forces, relative to themselves, that ends the passes.
const SETTLED: f64 = 1e-8;
const PASSES: u32 = 60;
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
        let mut iterations = self.solve(fields, context)?;
        if !self.external.has_contact() {
            return Ok(iterations);
        }
        for _ in 0..PASSES {
            let [change, size] = self.external.augment(fields);
            if change <= SETTLED * SETTLED * size {
                return Ok(iterations);
            }
            iterations += self.solve(fields, context)?;
        }
        Err(StepFailure::Contact)
    }
}
