//! Newton's method on both fields and on the position of the platen, with a prescribed increase of the crack energy.
//!
//! Rate-independent damage can snap back: at a slightly larger displacement there is no equilibrium near the last
//! equilibrium. At a slightly larger crack energy there is such an equilibrium. The constraint E_frac(φ) = E, where
//! E_frac is the crack energy and E its prescribed value, adds a row and a column to the linear system (bordering). The
//! bordered system needs two solutions with the same factor.
//!
//! Reference: Verhoosel, Remmers & Gutiérrez, Int. J. Numer. Meth. Engng 77 (2009) 1290, doi:10.1002/nme.2447. Here
//! the crack energy itself replaces the secant approximation of the dissipation.

use super::linear::Nodal;
use super::newton::Newton;
use super::norms::Equations;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Increment, Residual, StepContext};

/// Relative residual of the linear solutions. A small residual is necessary because the bordering amplifies the error
/// of a solution.
const LINEAR_TOLERANCE: f64 = 1e-8;

/// Constraint on the crack energy, which adds the position of the loaded ends to the unknowns.
pub(crate) struct ArcLengthControl<'a> {
    /// Sets the prescribed values of the fields for a position of the loaded ends. The position is given as the
    /// fraction of the test's duration after which the ends have this position.
    pub(crate) place: &'a dyn Fn(&mut Fields, f64),
    /// Step of the position for the finite difference that approximates the derivative of the residual (fraction of the
    /// duration).
    pub(crate) nudge: f64,
    /// Prescribed crack energy at the end of the increment, N mm.
    pub(crate) fracture: f64,
    /// Increase of the crack energy in this increment, N mm.
    pub(crate) release: f64,
}

impl ArcLengthControl<'_> {
    /// Solves for the fields and for the position of the loaded ends, from the guess in `fields`; returns the position.
    ///
    /// The damage must be rate independent. After an error, `fields` is not in equilibrium.
    pub(crate) fn solve(
        &self,
        newton: &mut Newton,
        fields: &mut Fields,
        mut position: f64,
        context: StepContext,
    ) -> Result<f64, StepFailure> {
        let tolerance = newton.settings.tolerance;
        let mut moved = Residual::new(fields.damage.len());
        let iterations = newton.settings.iterations;
        for _ in 0..iterations {
            let norms = newton.begin(fields, context)?;
            let gap = self.fracture - newton.residual.fracture;
            if norms.converged(Equations::Both, tolerance) && gap.abs() <= tolerance * self.release
            {
                return Ok(position);
            }
            newton.linearise_both(fields, context)?;
            let nodal = newton.residual.nodal.clone();
            let correction = newton.solve_nodal(&nodal, LINEAR_TOLERANCE)?;
            let mut shifted = fields.clone();
            (self.place)(&mut shifted, position + self.nudge);
            let increment = Increment { materials: newton.materials, fields: &shifted, context };
            newton.operator.residual(&increment, &mut moved)?;
            let border: Vec<Nodal> = (moved.nodal.iter().zip(&nodal))
                .map(|(a, b)| std::array::from_fn(|k| (a[k] - b[k]) / self.nudge))
                .collect();
            let response = newton.solve_nodal(&border, LINEAR_TOLERANCE)?;

            let (along_correction, along_response) =
                (growth(newton, &correction), growth(newton, &response));
            let shift = -(gap + along_correction) / along_response;
            if !shift.is_finite() {
                return Err(StepFailure::Singular);
            }
            position += shift;
            (self.place)(fields, position);
            for (n, (correction, response)) in correction.iter().zip(&response).enumerate() {
                for k in 0..3 {
                    fields.displacement[n][k] -= correction[k] + shift * response[k];
                }
                fields.damage[n] -= correction[3] + shift * response[3];
            }
        }
        let residual = newton.relative;
        Err(StepFailure::TooManyIterations { iterations, residual })
    }
}

/// Returns the derivative ∂E_frac/∂φ · x of the crack energy in the direction x. Without viscosity, ∂E_frac/∂φ is the
/// damage residual minus the driving force.
fn growth(newton: &Newton, x: &[Nodal]) -> f64 {
    let slope = newton.residual.nodal.iter().zip(&newton.residual.drive).map(|(r, d)| r[3] - d);
    let terms: Vec<f64> = slope.zip(x).map(|(s, x)| s * x[3]).collect();
    let halo = &newton.operator.part().halo;
    let mut sum = [halo.own_of(&terms).sum()];
    halo.ranks().sum(&mut sum);
    sum[0]
}
