//! Derivatives of force and displacement of the platen, which are updated in each increment of a run.

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
    let duration = (target - state.clock) * setup.definition.schedule.duration_s;
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
        is_variational: setup
            .definition
            .phase_field
            .as_ref()
            .is_none_or(PhaseField::is_variational)
            && setup.definition.materials.iter().all(|material| material.strength.is_none()),
    };
    let platen = boundary.driven_platen(fields.damage.len());
    let motion = platen.as_ref().map(|platen| &platen.motion[..]);
    let rates = differentiate(&mut solver.newton, at, &known, measured, motion);
    let force = |r: &Rates| boundary.force_rate(&r.residual, &r.contact) + r.correction;
    let rates = rates.map(|mut rates| {
        let response = platen.is_some().then(|| rates.pop()).flatten();
        let mut force_n: Vec<f64> = rates.iter().map(force).collect();
        let mut platen_mm = Vec::new();
        if let Some(response) = response {
            let starts = &state.derivatives.corner;
            platen_mm = follow_program(setup, target, starts, force(&response), &mut force_n);
            for (rates, moved_mm) in rates.iter_mut().zip(&platen_mm) {
                for (value, response) in rates.values.iter_mut().zip(&response.values) {
                    (0..4).for_each(|k| value[k] += moved_mm * response[k]);
                }
            }
        }
        (rates, force_n, platen_mm)
    });
    let operator = setup.discretisation.operator.as_ref();
    let increment = Increment { materials: &setup.point_materials, fields, context };
    let rates = rates.and_then(|(rates, force_n, platen_mm)| {
        let states = known.iter().zip(&rates).map(|(known, rates)| {
            if context.state.is_empty() {
                return Ok(Vec::new());
            }
            state_rate(operator, &increment, &known.shift, &rates.values)
        });
        let states = states.collect::<Result<Vec<_>, _>>()?;
        Ok((rates, force_n, platen_mm, states))
    });
    let derivatives = &mut state.derivatives;
    let (rates, force_n, platen_mm, states) = match rates {
        Ok(rates) => rates,
        Err(reason) => {
            let curve = std::mem::take(&mut derivatives.curve);
            let platen_curve = std::mem::take(&mut derivatives.platen_curve);
            let lost = Some(reason.to_string());
            *derivatives = Derivatives { lost, curve, platen_curve, ..Derivatives::default() };
            return;
        }
    };
    if setup.definition.schedule.is_corner(target) && !platen_mm.is_empty() {
        let corner = platen_mm.iter().zip(&force_n).map(|(&platen, &force)| [platen, force]);
        derivatives.corner = corner.collect();
    }
    (derivatives.force_n, derivatives.platen_mm) = (force_n, platen_mm);
    derivatives.adjoint = adjoint;
    derivatives.state = states;
    let before = std::mem::take(&mut derivatives.values);
    for (earlier, before) in derivatives.earlier.iter_mut().zip(before) {
        earlier.insert(0, before);
        earlier.truncate(EARLIER);
    }
    derivatives.values = rates.into_iter().map(|rates| rates.values).collect();
}

/// Returns the rates of the displacement of the platen at `target`, and changes `force_n`, the rates of the force at
/// constant platen, into the rates at the load that the program prescribes.
///
/// `starts` contains the rates of displacement and force at the last corner, which the prescribed load of a segment may
/// depend on. `stiffness` is the derivative of the force with respect to the displacement of the platen, N/mm.
fn follow_program(
    setup: &Setup,
    target: f64,
    starts: &[[f64; 2]],
    stiffness: f64,
    force_n: &mut [f64],
) -> Vec<f64> {
    let schedule = &setup.definition.schedule;
    let time_s = target * schedule.duration_s;
    let effect = schedule.force_program.as_ref().map_or(0.0, |p| p.effect_of_start(time_s));
    let prescribes_force = schedule.prescribes_force_at(target);
    let follow = |(k, force_n): (usize, &mut f64)| {
        let [start_mm, start_n] = starts.get(k).copied().unwrap_or_default().map(|r| effect * r);
        let platen_mm = if prescribes_force { (start_n - *force_n) / stiffness } else { start_mm };
        *force_n = if prescribes_force { start_n } else { *force_n + stiffness * platen_mm };
        platen_mm
    };
    force_n.iter_mut().enumerate().map(follow).collect()
}
