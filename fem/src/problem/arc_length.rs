//! Steps of prescribed crack energy, through a snap-back.

use super::stepper::LoadStepper;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::solve::Control;

/// A step of the ends that fails or releases too much is cut so far before the arc length takes over.
const CUTS: f64 = 64.0;
/// Least release of a step, as a fraction of the one asked for.
const LEAST: f64 = 1e-4;
const CUT: f64 = 0.5;
const GROWTH: f64 = 1.5;
/// Difference of positions, as a fraction of the duration.
const NUDGE: f64 = 1e-6;

impl LoadStepper<'_> {
    /// One step along the equilibrium: of the ends, no longer than `largest`, while they release
    /// little, else of released energy, at most `limit` (N mm).
    pub(super) fn step_by_arc_length(
        &mut self,
        largest: f64,
        limit: f64,
    ) -> Result<(), StepFailure> {
        loop {
            let (step, release) = (self.state.step, self.state.arc.release);
            if self.state.arc.leads {
                match self.advance_by_release(step, release) {
                    Ok(()) => {
                        self.state.arc.release = limit.min(GROWTH * release);
                        // nearly elastic again: the ends lead
                        if self.moved() > largest {
                            (self.state.arc.leads, self.state.step) = (false, largest);
                        }
                        return Ok(());
                    }
                    Err(_) if release > LEAST * limit => {
                        self.solver.effort.cuts += 1;
                        self.state.arc.release *= CUT;
                    }
                    Err(failure) => return Err(failure),
                }
            } else {
                match self.advance_within(step, limit) {
                    Ok(()) => {
                        self.state.step = largest.min(GROWTH * step);
                        return Ok(());
                    }
                    Err(_) if step > largest / CUTS => {
                        self.solver.effort.cuts += 1;
                        self.state.step *= CUT;
                    }
                    Err(_) => self.state.arc.leads = true,
                }
            }
        }
    }

    /// The last increment of the clock.
    fn moved(&self) -> f64 {
        self.state.change.as_ref().map_or(0.0, |(_, moved)| *moved)
    }

    /// A step of the ends, unless it would add more than `limit` to the crack energy.
    fn advance_within(&mut self, step: f64, limit: f64) -> Result<(), StepFailure> {
        let target = (self.state.clock + step).min(1.0);
        let mut fields = self.guess(target);
        let before = self.solver.effort;
        let context = self.state.memory.context(&self.state.fields.damage, 1.0);
        self.solver.solve_monolithic(&mut fields, context)?;
        if self.solver.residual.fracture - self.state.point.fracture_n_mm > limit {
            return Err(StepFailure::Release);
        }
        self.accept(before, fields, target)
    }

    /// A step that adds `release` to the crack energy, N mm, wherever the ends must go.
    fn advance_by_release(&mut self, step: f64, release: f64) -> Result<(), StepFailure> {
        let guess = match self.state.arc.released {
            Some(last) => self.state.clock + release / last * self.moved(),
            // past the last elastic state, so that some damage is free to grow
            None => self.state.clock + step,
        };
        let mut fields = self.guess(guess);
        let before = self.solver.effort;
        let problem = self.problem;
        let control = Control {
            place: &|fields: &mut Fields, position| problem.place(fields, position),
            nudge: NUDGE,
            fracture: self.state.point.fracture_n_mm + release,
            release,
        };
        let context = self.state.memory.context(&self.state.fields.damage, 1.0);
        let position = self.solver.solve_release(&mut fields, guess, &control, context)?;
        self.accept(before, fields, position)?;
        self.state.arc.released = Some(release);
        Ok(())
    }
}
