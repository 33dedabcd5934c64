//! Passes over the contact pressures of an increment.

use crate::compression::Fields;
use crate::operator::Span;
use crate::solve::{Solver, StepFailure};

/// Change of the contact forces, relative to themselves, that ends the passes.
const SETTLED: f64 = 1e-8;
const PASSES: u32 = 60;

impl Solver<'_> {
    /// Solves one increment with its contact; returns the iterations it took.
    pub(crate) fn equilibrium(
        &mut self,
        fields: &mut Fields,
        span: Span,
    ) -> Result<u32, StepFailure> {
        if self.applied.contacts.iter().any(|c| !c.warm) {
            self.guess_pressures(fields, span)?;
        }
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

    /// Takes the pressures of a first increment from the stress at its start.
    fn guess_pressures(&mut self, fields: &Fields, span: Span) -> Result<(), StepFailure> {
        let mut contacts = std::mem::take(&mut self.applied.contacts);
        let stressed = self.evaluate(fields, span);
        for contact in &mut contacts {
            contact.guess_pressures(fields, &self.residual.nodal);
        }
        self.applied.contacts = contacts;
        stressed.map(|_| ())
    }
}
