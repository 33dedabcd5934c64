//! The loop over the load steps, for a user to drive.

use std::fmt;

use super::checkpoint::Checkpoint;
use super::curve::{CurvePoint, End, Outcome};
use super::problem::Problem;
use super::schedule::Stepping;
use super::state::State;
use crate::boundary::ExternalForces;
use crate::error::{FemError, StepFailure};
use crate::fields::Fields;
use crate::solve::{Effort, Solver};

/// A step that converges lets the next one grow by this factor.
const GROWTH: f64 = 1.5;
/// A step that does not is cut by this one.
const CUT: f64 = 0.5;
/// Least step, as a fraction of the duration.
const LEAST: f64 = 1e-6;

/// A run in progress, one load step at a time; [`Problem::start`] makes it.
///
/// A step that finds no equilibrium is cut; a run that cannot go on returns the reason, and
/// [`finish`](Self::finish) the curve so far.
///
/// # Example
/// ```
/// use fem::{CompressionTest, CylinderLattice, Material, Schedule};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 4))
///     .builder(mesh)?
///     .materials([Material::hencky(275.0, 0.25)])
///     .build()?;
/// let mut run = problem.start();
/// while let Some(point) = run.step()? {
///     let lowest = run.fields().displacement.iter().map(|u| u[2]).fold(0.0, f64::min);
///     assert!((lowest + point.displacement_mm).abs() < 1e-12);
/// }
/// assert_eq!(run.finish().curve.len(), 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct LoadStepper<'a> {
    pub(super) problem: &'a Problem,
    pub(super) solver: Solver<'a, ExternalForces>,
    pub(super) state: State,
    /// Where the state is kept, with the fingerprint of the problem.
    checkpoint: Option<(Checkpoint, u64)>,
    end: Option<End>,
}

impl fmt::Debug for LoadStepper<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let State { point, recorded, .. } = &self.state;
        f.debug_struct("LoadStepper")
            .field("steps", recorded)
            .field("point", point)
            .field("end", &self.end)
            .finish_non_exhaustive()
    }
}

impl<'a> LoadStepper<'a> {
    /// A run from the unloaded body.
    pub(super) fn new(problem: &'a Problem) -> Self {
        let field = problem.parts.phase_field.as_ref();
        let state = State::new(&problem.discretisation, field, problem.parts.schedule.stepping);
        Self { problem, solver: problem.solver(), state, checkpoint: None, end: None }
    }

    /// A run that keeps its state on disk, from what is there.
    pub(super) fn resume(problem: &'a Problem, checkpoint: &Checkpoint) -> Result<Self, FemError> {
        checkpoint.validate()?;
        let fingerprint = problem.parts.fingerprint();
        let mut run = Self::new(problem);
        if let Some(state) = checkpoint.load(fingerprint)? {
            run.solver.effort = state.effort;
            run.state = state;
        }
        run.checkpoint = Some((checkpoint.clone(), fingerprint));
        Ok(run)
    }

    /// Takes the next load step; `None` once the run has ended.
    ///
    /// # Errors
    /// [`FemError::NotConverged`] if there is no equilibrium even after the least step, and
    /// [`FemError::Io`] if the state cannot be saved. The run has then ended.
    pub fn step(&mut self) -> Result<Option<CurvePoint>, FemError> {
        if self.end.is_some() {
            return Ok(None);
        }
        let point = self.next_point();
        if let Err(error) = &point {
            self.end = Some(End::Failed(error.clone()));
        }
        point.map(Some)
    }

    /// The fields at the last point, at rest before the first.
    pub fn fields(&self) -> &Fields {
        &self.state.fields
    }

    /// The points so far, those before a continuation included.
    pub fn curve(&self) -> &[CurvePoint] {
        &self.state.curve
    }

    /// Work done by the solver so far.
    pub fn effort(&self) -> Effort {
        self.solver.effort
    }

    /// What the run has yielded; a run that had not ended yet is [`End::Interrupted`].
    pub fn finish(self) -> Outcome {
        let contact = self.solver.external.contact_points(&self.state.fields);
        let State { curve, fields, reactions, .. } = self.state;
        let end = self.end.unwrap_or(End::Interrupted);
        Outcome { curve, end, fields, reactions, contact, effort: self.solver.effort }
    }

    fn next_point(&mut self) -> Result<CurvePoint, FemError> {
        let reached = match self.problem.parts.schedule.stepping {
            Stepping::Fixed(steps) => self.step_in_time(1.0 / f64::from(steps), Some(steps)),
            Stepping::Adaptive { largest, .. } => self.step_in_time(largest, None),
            Stepping::ArcLength { step, release_n_mm } => {
                self.step_by_arc_length(step, release_n_mm)
            }
        };
        reached.map_err(|failure| self.not_converged(failure))?;
        let point = self.record();
        if self.end.is_none() {
            self.save()?;
        }
        Ok(point)
    }

    /// Increments of time up to the next point: one, no longer than `largest`, or with `steps` as
    /// many as it takes to the next of so many equal ones.
    fn step_in_time(&mut self, largest: f64, steps: Option<u32>) -> Result<(), StepFailure> {
        let next = f64::from(self.state.recorded + 1);
        let mark = steps.map_or(1.0, |steps| next / f64::from(steps));
        loop {
            let (clock, step) = (self.state.clock, self.state.step);
            // no sliver of a step before the mark
            let target = if clock + 1.01 * step >= mark { mark } else { clock + step };
            match self.advance(target) {
                Err(_) if step > LEAST => {
                    self.solver.effort.cuts += 1;
                    self.state.step = CUT * (target - clock);
                    continue;
                }
                Err(failure) => return Err(failure),
                Ok(()) => self.state.step = largest.min(GROWTH * step),
            }
            if steps.is_none() || target >= mark {
                return Ok(());
            }
        }
    }

    /// Puts the state on the curve and notes the end, if it is one.
    fn record(&mut self) -> CurvePoint {
        let state = &mut self.state;
        let point = state.point;
        state.recorded += 1;
        state.curve.push(point);
        for (surface, &force) in &state.reaction {
            state.reactions.entry(surface.clone()).or_default().push(force);
        }
        state.peak = state.peak.max(point.force_n);
        // counted anew for the next point
        (state.point.newton, state.point.linear) = (0, 0);
        let below = |fraction| point.force_n < (1.0 - fraction) * state.peak;
        if self.problem.parts.schedule.stop_below_peak.is_some_and(below) {
            self.end = Some(End::BelowPeak);
        } else if state.clock >= 1.0 {
            self.end = Some(End::Displacement);
        }
        point
    }

    /// Saves the state where that is due, and forgets what the solver keeps from step to step: so the
    /// same steps follow whether or not the run goes on from here.
    fn save(&mut self) -> Result<(), FemError> {
        let Some((checkpoint, fingerprint)) = &self.checkpoint else { return Ok(()) };
        if self.state.recorded.is_multiple_of(checkpoint.every) {
            self.state.effort = self.solver.effort;
            checkpoint.save(&self.state, *fingerprint)?;
            self.solver = self.problem.solver();
            self.solver.effort = self.state.effort;
        }
        Ok(())
    }

    fn not_converged(&self, source: StepFailure) -> FemError {
        let duration_s = self.problem.parts.schedule.duration_s;
        FemError::NotConverged {
            displacement_mm: self.state.point.displacement_mm,
            time_s: self.state.clock * duration_s,
            step_s: self.state.step * duration_s,
            source,
        }
    }
}
