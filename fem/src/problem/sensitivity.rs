//! Derivatives of the force, which are updated in each increment of a run.

use super::definition::Setup;
use super::state::{Derivatives, RunState};
use crate::fields::Fields;
use crate::material::PhaseField;
use crate::operator::{Increment, Shift, state_rate};
use crate::solve::{Equilibrium, Known, Measured, Rates, Solver, differentiate};

/// Number of equilibria before the last equilibrium whose rates are stored. The rates of the stored equilibria and of
/// the last equilibrium can be extrapolated by a parabola in time.
const EARLIER: usize = 2;

/// Computes the derivatives of `fields`, the equilibrium at the fraction `target` of the duration, with respect to the
/// parameters (their *rates*), from the rates of the current state.
///
/// If the linear systems have no solution, no derivatives are computed from this equilibrium on, and the reason is
/// stored.
pub(super) fn carry_rates(
    setup: &Setup,
    solver: &mut Solver,
    state: &mut RunState,
    fields: &Fields,
    target: f64,
) {
    if state.derivatives.values.is_empty() {
        return;
    }
    let mut adjoint = std::mem::take(&mut state.derivatives.adjoint);
    let Derivatives { values, earlier, .. } = &state.derivatives;
    let duration = (target - state.clock) * setup.parts.schedule.duration_s;
    let context = state.memory.context(&state.fields.damage, duration);
    let starts = values.iter().zip(earlier).zip(&state.derivatives.state);
    let known: Vec<Known> = setup
        .shifts
        .iter()
        .zip(starts)
        .map(|(shift, ((before, earlier), state))| {
            let (below, above) = (&shift.below[..], &shift.above[..]);
            Known { shift: Shift { below, above, width: shift.width, before, state }, earlier }
        })
        .collect();
    let boundary = &setup.discretisation.boundary;
    let functional = boundary.measured(fields.damage.len());
    let measured = Measured { of_residual: functional.as_deref(), adjoint: &mut adjoint };
    let at = Equilibrium {
        fields,
        context,
        bound_follows_damage: state.memory.bound_follows_damage(),
        is_variational: setup.parts.phase_field.as_ref().is_none_or(PhaseField::is_variational)
            && setup.parts.materials.iter().all(|material| material.strength.is_none()),
    };
    let rates = differentiate(&mut solver.newton, at, &known, measured);
    let operator = setup.discretisation.operator.as_ref();
    let increment = Increment { materials: &setup.points, fields, context };
    let rates = rates.and_then(|rates| {
        let states = known.iter().zip(&rates).map(|(known, rates)| {
            if context.state.is_empty() {
                return Ok(Vec::new());
            }
            state_rate(operator, &increment, &known.shift, &rates.values)
        });
        let states = states.collect::<Result<Vec<_>, _>>()?;
        Ok((rates, states))
    });
    let derivatives = &mut state.derivatives;
    let (rates, states) = match rates {
        Ok(rates) => rates,
        Err(reason) => {
            let curve = std::mem::take(&mut derivatives.curve);
            let lost = Some(reason.to_string());
            *derivatives = Derivatives { lost, curve, ..Derivatives::default() };
            return;
        }
    };
    let force = |r: &Rates| boundary.force_rate(&r.residual, &r.contact) + r.correction;
    derivatives.force_n = rates.iter().map(force).collect();
    derivatives.adjoint = adjoint;
    derivatives.state = states;
    let before = std::mem::take(&mut derivatives.values);
    for (earlier, before) in derivatives.earlier.iter_mut().zip(before) {
        earlier.insert(0, before);
        earlier.truncate(EARLIER);
    }
    derivatives.values = rates.into_iter().map(|rates| rates.values).collect();
}
