//! Alternate minimisation: displacement at fixed damage, then damage at fixed displacement.
//!
//! Each of the two problems is (nearly) convex although their sum is not, so this converges where
//! Newton on both fields fails, if slowly; Newton finishes once it is close.

use super::newton::{Field, Solver, StepFailure};
use super::options::Scheme;
use crate::compression::Fields;
use crate::operator::Span;

/// Alternations between two tries to finish with Newton.
const BETWEEN_FINISHES: u32 = 8;
/// How far below the tolerance each field is solved, so that the other's residual decides.
const MARGIN: f64 = 0.1;

impl Solver<'_> {
    pub(super) fn alternate(&mut self, fields: &mut Fields, span: Span) -> Result<(), StepFailure> {
        let tolerance = self.options.tolerance;
        for pass in 1..=self.options.alternations {
            self.newton(Field::Displacement, fields, span, MARGIN * tolerance)?;
            self.newton(Field::Damage, fields, span, MARGIN * tolerance)?;
            if self.evaluate(fields, span)?.converged(Field::Both, tolerance) {
                return Ok(());
            }
            if self.options.scheme == Scheme::Monolithic && pass % BETWEEN_FINISHES == 0 {
                let mut finish = fields.clone();
                if self.newton(Field::Both, &mut finish, span, tolerance).is_ok() {
                    *fields = finish;
                    return Ok(());
                }
            }
        }
        Err(StepFailure::TooMany)
    }
}
