//! Newton on both fields and on the position of the platen, with a prescribed increase of the crack energy.
//!
//! Rate-independent damage can snap back: no equilibrium near the last one exists at the given displacement, but one
//! exists at a given crack energy. The constraint E_frac(φ) = E borders the system; one factor solves it for two
//! right-hand sides.
//!
//! Reference: Verhoosel, Remmers & Gutiérrez, Int. J. Numer. Meth. Engng 77 (2009) 1290, doi:10.1002/nme.2447. Here
//! the crack energy itself replaces the secant approximation of the dissipation.

use super::external::External;
use super::linear::Nodal;
use super::newton::Solver;
use super::norms::Equations;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Increment, Residual, StepContext};

/// Relative residual of the linear solutions. It is small because the bordering multiplies the error of a solution.
const LINEAR_TOLERANCE: f64 = 1e-8;

/// Constraint on the crack energy, and its control of the boundary displacement.
pub(crate) struct Control<'a> {
    /// Imposes the prescribed values of a position of the ends.
    pub(crate) place: &'a dyn Fn(&mut Fields, f64),
    /// Finite-difference step in position, for the derivative of the residual.
    pub(crate) nudge: f64,
    /// The crack energy to reach, N mm.
    pub(crate) fracture: f64,
    /// Increase of the crack energy in this increment, N mm.
    pub(crate) release: f64,
}

impl<E: External> Solver<'_, E> {
    /// Solves for the fields and the position from the guess in `fields`; returns the position.
    ///
    /// The damage must be rate independent. After a failure `fields` is not in equilibrium.
    pub(crate) fn solve_release(
        &mut self,
        fields: &mut Fields,
        mut position: f64,
        control: &Control,
        context: StepContext,
    ) -> Result<f64, StepFailure> {
        let tolerance = self.options.tolerance;
        let mut moved = Residual::new(fields.damage.len());
        for _ in 0..self.options.iterations {
            let norms = self.begin(fields, context)?;
            let gap = control.fracture - self.residual.fracture;
            if norms.converged(Equations::Both, tolerance)
                && gap.abs() <= tolerance * control.release
            {
                return Ok(position);
            }
            self.linearise_both(fields, context)?;
            let nodal = self.residual.nodal.clone();
            let newton = self.solve_nodal(&nodal, LINEAR_TOLERANCE)?;
            let mut shifted = fields.clone();
            (control.place)(&mut shifted, position + control.nudge);
            let increment = Increment { materials: self.materials, fields: &shifted, context };
            self.operator.residual(&increment, &mut moved)?;
            let border: Vec<Nodal> = (moved.nodal.iter().zip(&nodal))
                .map(|(a, b)| std::array::from_fn(|k| (a[k] - b[k]) / control.nudge))
                .collect();
            let response = self.solve_nodal(&border, LINEAR_TOLERANCE)?;

            let (along_newton, along_response) = (self.growth(&newton), self.growth(&response));
            let shift = -(gap + along_newton) / along_response;
            if !shift.is_finite() {
                return Err(StepFailure::Singular);
            }
            position += shift;
            (control.place)(fields, position);
            for (n, (newton, response)) in newton.iter().zip(&response).enumerate() {
                for k in 0..3 {
                    fields.displacement[n][k] -= newton[k] + shift * response[k];
                }
                fields.damage[n] -= newton[3] + shift * response[3];
            }
        }
        Err(StepFailure::TooManyIterations)
    }

    /// Returns ∂E_frac/∂φ · x. Without viscosity, ∂E_frac/∂φ is the damage residual minus the driving force.
    fn growth(&self, x: &[Nodal]) -> f64 {
        let slope = self.residual.nodal.iter().zip(&self.residual.drive).map(|(r, d)| r[3] - d);
        let terms: Vec<f64> = slope.zip(x).map(|(s, x)| s * x[3]).collect();
        let halo = &self.operator.part().halo;
        let mut sum = [halo.own_of(&terms).sum()];
        halo.ranks().sum(&mut sum);
        sum[0]
    }
}
