//! Newton step with a prescribed force of the platen.

use super::Newton;
use crate::error::StepFailure;
use crate::solve::force_control::ForceControl;
use crate::solve::linear::Nodal;

/// Relative residual of the linear solution for the response. The error of the response limits the convergence of
/// Newton's method, because each step contains a multiple of the response.
const RESPONSE_TOLERANCE: f64 = 1e-6;

impl Newton<'_> {
    /// Prescribes the force of the platen, N, in the following increments, or its displacement for `None`. The fields
    /// then contain the displacement.
    pub(crate) fn prescribe_force(&mut self, force_n: Option<f64>) {
        self.control.iter_mut().for_each(|control| control.prescribe(force_n));
    }

    /// Adds the displacement of the platen to the Newton step. `select` sets the equations that are not solved to zero.
    pub(super) fn complete_step(
        &mut self,
        control: &mut ForceControl,
        select: impl Fn(Vec<Nodal>) -> Vec<Nodal>,
    ) -> Result<(), StepFailure> {
        let operator = self.operator;
        let halo = &operator.part().halo;
        if control.needs_response() {
            let of_motion = self.multiply(control.motion());
            let border = select(control.border(of_motion.clone()));
            let tolerance = RESPONSE_TOLERANCE.min(self.settings.linear_tolerance);
            let response = self.solve_nodal(&border, tolerance)?;
            let of_response = self.multiply(&response);
            control.respond(response, &of_response, &of_motion, halo);
        }
        let mut step = std::mem::take(&mut self.step);
        let product = self.multiply(&step);
        let is_finite = control.complete(&mut step, &product, halo);
        self.step = step;
        if is_finite { Ok(()) } else { Err(StepFailure::Singular) }
    }

    /// Multiplies values by the stored tangent, with the rows and columns of constrained values.
    fn multiply(&mut self, x: &[Nodal]) -> Vec<Nodal> {
        let mut product = vec![[0.0; 4]; x.len()];
        self.linear.multiply(x, &mut product);
        product
    }
}
