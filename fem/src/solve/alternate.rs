//! Alternate minimisation: displacement at fixed damage, then damage at fixed displacement.
//!
//! Each of the two problems is (nearly) convex although the joint problem is not. Therefore, alternation converges
//! slowly in cases in which Newton's method on both fields fails. Close to the solution, Newton's method on both fields
//! takes over because it is faster.
//!
//! While a crack grows, each alternation advances the crack by a fraction of an element. The alternations are not
//! contractive, so extrapolation is not possible (Anderson acceleration converges to other states). Instead, damage is
//! over-relaxed, as in successive over-relaxation.
//!
//! Reference: Farrell & Maurini, Int. J. Numer. Meth. Engng 109 (2017) 648, doi:10.1002/nme.5300.

use super::newton::Newton;
use super::norms::Equations;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// Number of alternations between two attempts to finish with Newton's method on both fields.
const BETWEEN_FINISHES: u32 = 8;
/// Tolerance of the solution for one field in the last alternations, as a fraction of the tolerance of the increment.
/// With this small fraction, convergence depends only on the residual that the solution for the other field causes.
const MARGIN: f64 = 0.1;
/// Tolerance of the solution for one field in the earlier alternations, as a fraction of the larger residual of the two
/// fields. A smaller tolerance would waste time, because the solution for the other field increases the residual again.
const ENOUGH: f64 = 0.3;
/// Number of alternations before over-relaxation of the damage begins.
const PATIENCE: u32 = 4;
/// Over-relaxation factor: the change of damage in an alternation is multiplied by this factor.
const RELAXATION: f64 = 1.8;

/// Settings of alternate minimisation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alternation {
    /// Largest number of alternations (one solution for the displacement and one for the damage) per increment.
    pub(super) limit: u32,
    /// Whether Newton's method on both fields is tried every [`BETWEEN_FINISHES`] alternations, to finish faster.
    pub(super) finishes_together: bool,
}

impl Alternation {
    /// Solves for both fields from the guess in `fields`.
    pub(super) fn solve(
        self,
        newton: &mut Newton,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        let tolerance = newton.settings.tolerance;
        let mut inner = MARGIN * tolerance;
        let mut norms = newton.begin(fields, context)?;
        for pass in 1..=self.limit {
            let before = fields.damage.clone();
            norms = newton.iterate(Equations::Displacement, fields, context, norms, inner)?;
            norms = newton.iterate(Equations::Damage, fields, context, norms, inner)?;
            if norms.converged(Equations::Both, tolerance) {
                return Ok(());
            }
            inner = (ENOUGH * norms.largest()).max(MARGIN * tolerance);
            if self.finishes_together && pass % BETWEEN_FINISHES == 0 {
                let mut finish = fields.clone();
                let both = Equations::Both;
                if newton.iterate(both, &mut finish, context, norms, tolerance).is_ok() {
                    *fields = finish;
                    return Ok(());
                }
                norms = newton.evaluate(fields, context)?;
            }
            if pass >= PATIENCE {
                for (phi, before) in fields.damage.iter_mut().zip(&before) {
                    *phi = before + RELAXATION * (*phi - before);
                }
                norms = newton.begin(fields, context)?;
            }
        }
        let (iterations, residual) = (self.limit, norms.largest());
        Err(StepFailure::TooManyIterations { iterations, residual })
    }
}
