//! The derivatives of the force, from increment to increment.

use super::state::Derivatives;
use super::stepper::LoadStepper;
use crate::fields::Fields;
use crate::operator::Shift;
use crate::solve::Known;

/// Earlier equilibria whose rates are kept: with the last one they follow a cubic in time.
const EARLIER: usize = 3;

impl LoadStepper<'_> {
    /// Takes the derivatives from the state to `fields`, the equilibrium that the solver has found at
    /// `target`; without equilibrium of the rates there are none from here on.
    pub(super) fn differentiate(&mut self, fields: &Fields, target: f64) {
        let (problem, state) = (self.problem, &mut self.state);
        let Derivatives { values, earlier, lost, .. } = &state.derivatives;
        if values.is_empty() || *lost {
            return;
        }
        let duration = (target - state.clock) * problem.parts.schedule.duration_s;
        let context = state.memory.context(&state.fields.damage, duration);
        let known: Vec<Known> = problem
            .shifts
            .iter()
            .zip(values.iter().zip(earlier))
            .map(|(shift, (before, earlier))| {
                let (below, above) = (&shift.below[..], &shift.above[..]);
                Known { shift: Shift { below, above, width: shift.width, before }, earlier }
            })
            .collect();
        let rates = self.solver.differentiate(fields, context, &known, state.memory.follows());
        let derivatives = &mut state.derivatives;
        let Ok(rates) = rates else {
            *derivatives = Derivatives {
                lost: true,
                curve: std::mem::take(&mut derivatives.curve),
                ..Derivatives::default()
            };
            return;
        };
        let boundary = &problem.discretisation.boundary;
        derivatives.force_n =
            rates.iter().map(|r| boundary.force_rate(&r.residual, &r.contact)).collect();
        let before = std::mem::take(&mut derivatives.values);
        for (earlier, before) in derivatives.earlier.iter_mut().zip(before) {
            earlier.insert(0, before);
            earlier.truncate(EARLIER);
        }
        derivatives.values = rates.into_iter().map(|rates| rates.values).collect();
    }
}
