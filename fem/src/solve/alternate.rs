//! Alternate minimisation: displacement at fixed damage, then damage at fixed displacement.
//!
//! Each of the two problems is (nearly) convex although their sum is not, so this converges where
//! Newton on both fields fails, if slowly; Newton finishes once it is close.
//!
//! While a crack runs, each turn advances it by a part of an element: the turns do not contract, so
//! that there is nothing to extrapolate (Anderson's acceleration ends in other states), but damage
//! may go further than its equilibrium, as in successive over-relaxation.
//!
//! Reference: Farrell & Maurini, Int. J. Numer. Meth. Engng 109 (2017) 648, doi:10.1002/nme.5300.

use super::external::External;
use super::newton::Solver;
use super::norms::Equations;
use super::options::Scheme;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// Alternations between two tries to finish with Newton.
const BETWEEN_FINISHES: u32 = 8;
/// How far below the tolerance each field is solved at the end, so that the other's residual decides.
const MARGIN: f64 = 0.1;
/// How far below the residual of both fields each is solved before: more would be undone by the other.
const ENOUGH: f64 = 0.3;
/// Turns after which the change of damage is stretched, and by how much.
const PATIENCE: u32 = 4;
const RELAXATION: f64 = 1.8;

impl<E: External> Solver<'_, E> {
    pub(super) fn alternate(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        let tolerance = self.options.tolerance;
        let mut inner = MARGIN * tolerance;
        let mut norms = self.begin(fields, context)?;
        for pass in 1..=self.options.alternations {
            let before = fields.damage.clone();
            norms = self.newton(Equations::Displacement, fields, context, norms, inner)?;
            norms = self.newton(Equations::Damage, fields, context, norms, inner)?;
            if norms.converged(Equations::Both, tolerance) {
                return Ok(());
            }
            inner = (ENOUGH * norms.largest()).max(MARGIN * tolerance);
            if self.options.scheme == Scheme::Monolithic && pass % BETWEEN_FINISHES == 0 {
                let mut finish = fields.clone();
                if self.newton(Equations::Both, &mut finish, context, norms, tolerance).is_ok() {
                    *fields = finish;
                    return Ok(());
                }
                norms = self.evaluate(fields, context)?;
            }
            if pass >= PATIENCE {
                for (phi, before) in fields.damage.iter_mut().zip(&before) {
                    *phi = before + RELAXATION * (*phi - before);
                }
                norms = self.begin(fields, context)?;
            }
        }
        Err(StepFailure::TooManyIterations)
    }
}
