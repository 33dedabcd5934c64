//! The derivatives of the force, from increment to increment.

use super::state::Derivatives;
use super::stepper::LoadStepper;
use crate::fields::Fields;
use crate::operator::Shift;
use crate::solve::Known;

impl LoadStepper<'_> {
    /// Takes the derivatives from the state to `fields`, the equilibrium that the solver has found at
    /// `target`; without equilibrium of the rates there are none from here on.
    pub(super) fn differentiate(&mut self, fields: &Fields, target: f64) {
        let (problem, state) = (self.problem, &mut self.state);
        let Derivatives { values, change, lost, .. } = &state.derivatives;
        if values.is_empty() || *lost {
            return;
        }
        let duration = (target - state.clock) * problem.parts.schedule.duration_s;
        let context = state.memory.context(&state.fields.damage, duration);
        let known: Vec<Known> = problem
            .shifts
            .iter()
            .zip(values)
            .enumerate()
            .map(|(k, (shift, before))| {
                let (below, above) = (&shift.below[..], &shift.above[..]);
                let shift = Shift { below, above, width: shift.width, before };
                Known { shift, change: change.get(k).map_or(&[], Vec::as_slice) }
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
        derivatives.values = rates.into_iter().map(|rates| rates.values).collect();
        derivatives.change = before;
        let changes = derivatives.change.iter_mut().zip(&derivatives.values);
        for (change, values) in changes {
            let pairs = change.as_flattened_mut().iter_mut().zip(values.as_flattened());
            pairs.for_each(|(change, value)| *change = value - *change);
        }
    }
}
