//! Passes over the contact pressures of an increment.

use super::newton::{Solver, StepFailure};
use crate::boundary::ContactStep;
use crate::fields::Fields;
use crate::operator::Span;

/// Change of the contact forces, relative to themselves, that ends the passes.
const SETTLED: f64 = 1e-8;
const PASSES: u32 = 60;
/// Slip velocities, as multiples of the one asked for, by which friction sets in where it would not at
/// once: the sharper the change from stick to slip, the nearer must Newton's method start.
const ONSET: [f64; 3] = [100.0, 10.0, 1.0];

impl Solver<'_> {
    /// Solves one increment with its contact; returns the iterations it took.
    pub(crate) fn equilibrium(
        &mut self,
        fields: &mut Fields,
        span: Span,
    ) -> Result<u32, StepFailure> {
        if !self.applied.contacts.iter().any(ContactStep::has_friction) {
            return self.settle(fields, span);
        }
        let start = (fields.clone(), self.applied.contacts.clone());
        let settled = self.settle(fields, span);
        if settled.is_ok() {
            return settled;
        }
        self.effort.rescues += 1;
        (*fields, self.applied.contacts) = start;
        let mut iterations = 0;
        for bluntness in ONSET {
            self.applied.contacts.iter_mut().for_each(|c| c.bluntness = bluntness);
            iterations += self.settle(fields, span)?;
        }
        Ok(iterations)
    }

    /// Passes over the pressures until they agree with the gaps.
    fn settle(&mut self, fields: &mut Fields, span: Span) -> Result<u32, StepFailure> {
        let mut iterations = self.solve(fields, span)?;
        if self.applied.contacts.is_empty() {
            return Ok(iterations);
        }
        for _ in 0..PASSES {
            let [mut change, mut size] = [0.0; 2];
            for contact in &mut self.applied.contacts {
                let [c, s] = contact.update(fields);
                (change, size) = (change + c, size + s);
            }
            if change <= SETTLED * SETTLED * size {
                return Ok(iterations);
            }
            iterations += self.solve(fields, span)?;
        }
        Err(StepFailure::Contact)
    }
}
