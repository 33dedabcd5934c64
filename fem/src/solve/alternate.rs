//! Alternate minimisation: displacement at fixed damage, then damage at fixed displacement.
//!
//! Each of the two problems is (nearly) convex although their sum is not, so this converges where
//! Newton on both fields fails, if slowly; Newton finishes once it is close.

use super::newton::{Field, Solver, StepFailure};
use super::options::Scheme;
use crate::compression::Fields;

/// Alternations between two tries to finish with Newton.
const BETWEEN_FINISHES: u32 = 8;
/// How far below the tolerance each field is solved, so that the other's residual decides.
const MARGIN: f64 = 0.1;

impl Solver<'_> {
    pub(super) fn alternate(
        &mut self,
        fields: &mut Fields,
        damage_before: &[f64],
        duration: f64,
    ) -> Result<(), StepFailure> {
        let tolerance = self.options.tolerance;
        for pass in 1..=self.options.alternations {
            self.newton(Field::Displacement, fields, damage_before, duration, MARGIN * tolerance)?;
            self.newton(Field::Damage, fields, damage_before, duration, MARGIN * tolerance)?;
            if self.evaluate(fields, damage_before, duration)?.converged(Field::Both, tolerance) {
                return Ok(());
            }
            if self.options.scheme == Scheme::Monolithic && pass % BETWEEN_FINISHES == 0 {
                let mut finish = fields.clone();
                if self.newton(Field::Both, &mut finish, damage_before, duration, tolerance).is_ok()
                {
                    *fields = finish;
                    return Ok(());
                }
            }
        }
        Err(StepFailure::TooMany)
    }
}
