//! Steps of prescribed crack energy, through a snap-back.

use super::curve::End;
use super::loading::Stepping;
use super::march::{ArcState, March};
use crate::boundary::Conditions;
use crate::error::FemError;
use crate::fields::Fields;
use crate::material::{Material, PhaseField};
use crate::solve::{Control, Solver, StepFailure};

/// A platen step that fails or releases too much is cut so far before the arc length takes over.
const CUTS: f64 = 64.0;
/// Least release of a step, as a share of the one asked for.
const LEAST: f64 = 1e-4;
const CUT: f64 = 0.5;
const GROWTH: f64 = 1.5;
/// Difference of positions, as a share of the duration.
const NUDGE: f64 = 1e-6;

impl<'a> March<'a> {
    /// Follows the equilibrium: by steps of the platen while they release little, else by steps of
    /// released energy.
    pub(super) fn follow(&mut self, solver: &mut Solver<'a>, largest: f64, limit: f64) -> End {
        loop {
            let (step, ArcState { leads, release, .. }) = (self.state.step, self.state.arc);
            let advanced = if leads {
                self.advance_by_release(solver, step, release)
            } else {
                self.advance_within(solver, step, limit)
            };
            let state = &mut self.state;
            match (advanced, leads) {
                (Ok(()), false) => state.step = largest.min(GROWTH * step),
                (Ok(()), true) => {
                    state.arc.release = limit.min(GROWTH * release);
                    let moved = state.change.as_ref().map_or(0.0, |(_, moved)| *moved);
                    // nearly elastic again: the platen leads
                    if moved > largest {
                        (state.arc.leads, state.step) = (false, largest);
                    }
                }
                (Err(_), false) if step > largest / CUTS => {
                    solver.effort.cuts += 1;
                    state.step *= CUT;
                    continue;
                }
                (Err(_), false) => {
                    state.arc.leads = true;
                    continue;
                }
                (Err(_), true) if release > LEAST * limit => {
                    solver.effort.cuts += 1;
                    state.arc.release *= CUT;
                    continue;
                }
                (Err(reason), true) => return self.failure(reason),
            }
            if let Some(end) = self.record(solver) {
                return end;
            }
        }
    }

    /// A step of the platen, unless it would add more than `limit` to the crack energy.
    fn advance_within(
        &mut self,
        solver: &mut Solver,
        step: f64,
        limit: f64,
    ) -> Result<(), StepFailure> {
        let target = (self.state.clock + step).min(1.0);
        let mut fields = self.guess(target);
        let before = solver.effort;
        solver.solve_monolithic(
            &mut fields,
            self.state.memory.span(&self.state.fields.damage, 1.0),
        )?;
        if solver.residual.fracture - self.state.point.fracture_n_mm > limit {
            return Err(StepFailure::Stalled);
        }
        self.accept(solver, before, fields, target)
    }

    /// A step that adds `release` to the crack energy, N mm, wherever the platen must go.
    fn advance_by_release(
        &mut self,
        solver: &mut Solver,
        step: f64,
        release: f64,
    ) -> Result<(), StepFailure> {
        let guess = match self.state.arc.released {
            Some(last) => {
                let moved = self.state.change.as_ref().map_or(0.0, |(_, moved)| *moved);
                self.state.clock + release / last * moved
            }
            // past the last elastic state, so that some damage is free to grow
            None => self.state.clock + step,
        };
        let mut fields = self.guess(guess);
        let before = solver.effort;
        let start = self.state.point.fracture_n_mm;
        let control = Control {
            place: &|fields: &mut Fields, position| self.place(fields, position),
            nudge: NUDGE,
            fracture: start + release,
            release,
        };
        let span = self.state.memory.span(&self.state.fields.damage, 1.0);
        let position = solver.solve_release(&mut fields, guess, &control, span)?;
        self.accept(solver, before, fields, position)?;
        self.state.arc.released = Some(release);
        Ok(())
    }
}

/// Refuses what arc-length steps cannot follow.
pub(crate) fn check_arc_length(
    stepping: Stepping,
    materials: &[Material],
    field: Option<&PhaseField>,
    conditions: &Conditions,
) -> Result<(), FemError> {
    if !matches!(stepping, Stepping::ArcLength { .. }) {
        return Ok(());
    }
    let refuse = |message: &str, mend: &str| {
        Err(FemError::Unsupported {
            entity: "test".into(),
            message: format!("arc-length steps {message}"),
            mend: mend.into(),
        })
    };
    let damaged = || materials.iter().filter_map(|m| m.fracture);
    if !conditions.only_prescribe() {
        return refuse(
            "move prescribed displacements back and forth, which loads and platens do not follow",
            "prescribe the displacement of the ends, or take adaptive steps",
        );
    }
    if field.is_none() || damaged().next().is_none() {
        return refuse("control the crack energy, and nothing can break", "take adaptive steps");
    }
    if field.is_some_and(|f| !f.is_variational()) {
        return refuse(
            "need damage that makes an energy stationary",
            "take irreversibility = \"active-set\" or \"none\", and no hybrid split",
        );
    }
    if damaged().any(|m| m.viscosity_mpa_s > 0.0) {
        return refuse(
            "are for rate-independent damage",
            "set viscosity_mpa_s = 0, or take adaptive steps: viscous damage does not snap back",
        );
    }
    Ok(())
}
