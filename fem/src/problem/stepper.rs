//! Loop over the load steps, advanced by the user.

use std::collections::BTreeMap;
use std::fmt;

use super::checkpoint::Checkpoint;
use super::controller::{Progress, Step};
use super::curve::{CurvePoint, End, Outcome, Sensitivities};
use super::problem::Problem;
use super::state::{Derivatives, RunState, gather_fields};
use crate::boundary::ExternalForces;
use crate::error::{FemError, StepFailure};
use crate::fields::Fields;
use crate::parallel::{RankLost, Ranks, guarded};
use crate::solve::{Effort, Solver};

/// Limit of attempted steps for one point of the curve, for any controller.
const MOST_TRIES: u32 = 10_000;

/// Run in progress, advanced one load step at a time; created by [`Problem::start`].
///
/// A step without equilibrium is reduced. If the run cannot continue, [`step`](Self::step) returns the error, and
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
    /// State of the run; with several ranks, the part of this rank.
    pub(super) state: RunState,
    /// Fields of the whole body at the last point, if this rank has only a part of the body.
    whole: Option<Fields>,
    /// File for the state, and the fingerprint of the problem.
    checkpoint: Option<(Checkpoint, u64)>,
    end: Option<End>,
}

impl fmt::Debug for LoadStepper<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RunState { point, curve, .. } = &self.state;
        f.debug_struct("LoadStepper")
            .field("steps", &curve.len())
            .field("point", point)
            .field("end", &self.end)
            .finish_non_exhaustive()
    }
}

impl<'a> LoadStepper<'a> {
    /// Creates a run from the unloaded body.
    pub(super) fn new(problem: &'a Problem) -> Self {
        let field = problem.parts.phase_field.as_ref();
        let parameters = problem.shifts.len();
        let state = RunState::new(&problem.discretisation, field, &problem.points, parameters);
        let part = problem.discretisation.operator.part();
        let whole = (!part.is_whole()).then(|| Fields::zero(part.all_nodes));
        Self { problem, solver: problem.solver(), state, whole, checkpoint: None, end: None }
    }

    /// Creates a run that saves its state, starting from a saved state if there is one.
    pub(super) fn resume(problem: &'a Problem, checkpoint: &Checkpoint) -> Result<Self, FemError> {
        checkpoint.validate()?;
        let fingerprint = problem.parts.fingerprint();
        let mut run = Self::new(problem);
        run.checkpoint = Some((checkpoint.clone(), fingerprint));
        let loaded = guarded(|| checkpoint.load(fingerprint, run.ranks()));
        if let Some(state) = loaded.map_err(|lost| run.lost(lost))?? {
            run.solver.resume(state.effort);
            run.solver.scales = state.scales;
            if let Some(whole) = &mut run.whole {
                *whole = state.fields.clone();
            }
            run.state = state.of_part(&problem.discretisation);
        }
        Ok(run)
    }

    pub(super) fn ranks(&self) -> &'a Ranks {
        &self.problem.parts.ranks
    }

    /// Returns the error of a run that has lost a rank.
    fn lost(&self, RankLost(rank): RankLost) -> FemError {
        let saved = self.checkpoint.as_ref().map(|(checkpoint, _)| &checkpoint.path);
        FemError::RankLost { rank, checkpoint: saved.filter(|path| path.is_file()).cloned() }
    }

    /// Whether any rank stops here; `own` is the decision of this rank.
    pub(super) fn stops(&mut self, own: bool) -> bool {
        match guarded(|| self.ranks().any(own)) {
            Ok(stop) => stop,
            Err(lost) => {
                self.end = Some(End::Failed(self.lost(lost)));
                true
            }
        }
    }

    /// Takes the next load step; `None` once the run has ended.
    ///
    /// # Errors
    /// [`FemError::NotConverged`] if there is no equilibrium even after the smallest step, [`FemError::Io`] if the
    /// state cannot be saved, and [`FemError::RankLost`] if another rank has ended. The run has then ended.
    pub fn step(&mut self) -> Result<Option<CurvePoint>, FemError> {
        if self.end.is_some() {
            return Ok(None);
        }
        let point = match guarded(|| self.next_point()) {
            Ok(point) => point,
            Err(lost) => Err(self.lost(lost)),
        };
        if let Err(error) = &point {
            self.end = Some(End::Failed(error.clone()));
        }
        point.map(Some)
    }

    /// Fields of the whole body at the last point; zero before the first.
    pub fn fields(&self) -> &Fields {
        self.whole.as_ref().unwrap_or(&self.state.fields)
    }

    /// Points of the curve so far, including those before a resumption.
    pub fn curve(&self) -> &[CurvePoint] {
        &self.state.curve
    }

    /// Derivatives of the force at the points so far.
    pub fn sensitivities(&self) -> Sensitivities {
        let names = self.problem.parts.parameters.iter().map(|p| p.name.clone()).collect();
        let Derivatives { curve, lost, .. } = &self.state.derivatives;
        Sensitivities { names, force_n: curve.clone(), lost: lost.clone() }
    }

    /// Work done by the solver so far.
    pub fn effort(&self) -> Effort {
        self.solver.effort
    }

    /// Hardware that solves the linear systems, as text: name of a device, or the processor.
    pub fn machine(&self) -> String {
        self.solver.machine()
    }

    /// Returns the results of the run. A run that has not ended yet is reported as [`End::Interrupted`].
    pub fn finish(self) -> Outcome {
        let boundary = &self.problem.discretisation.boundary;
        let points = || self.solver.external.contact_points(boundary, &self.state.fields);
        // contact points cannot be gathered if a rank is lost
        let contact = match &self.end {
            Some(End::Failed(FemError::RankLost { .. })) => BTreeMap::new(),
            _ => guarded(points).unwrap_or_default(),
        };
        let sensitivities = self.sensitivities();
        let machine = self.machine();
        let RunState { curve, fields, reactions, .. } = self.state;
        let fields = self.whole.unwrap_or(fields);
        let end = self.end.unwrap_or(End::Interrupted);
        let effort = self.solver.effort;
        Outcome { curve, sensitivities, end, fields, reactions, contact, effort, machine }
    }

    /// Takes steps up to the next point of the curve.
    fn next_point(&mut self) -> Result<CurvePoint, FemError> {
        let controller = &self.problem.parts.schedule.steps;
        let marks = controller.marks();
        let next = (self.state.curve.len() + 1) as f64;
        let mark = marks.map_or(1.0, |points| next / f64::from(points));
        let (mut failed, mut failure) = (None, StepFailure::GivenUp);
        for _ in 0..MOST_TRIES {
            let passed = self.state.clock;
            let Some(step) = controller.next(&self.progress(failed)) else { break };
            step.validate(controller.controls_crack_energy())?;
            self.solver.effort.cuts += u32::from(failed.is_some());
            // extend the step to the mark if the rest would be less than 1 % of the step
            let reaches = passed + 1.01 * step.fraction() >= mark;
            let target = if reaches { mark } else { passed + step.fraction() };
            let before = self.solver.effort;
            match self.take(step, target) {
                Ok(()) => {
                    (self.state.taken, failed) = (Some(step), None);
                    if marks.is_none() || target >= mark {
                        return self.record();
                    }
                }
                Err(reason) => {
                    let Effort { iterations, linear, .. } = self.solver.effort;
                    self.state.point.newton += iterations - before.iterations;
                    self.state.point.linear += linear - before.linear;
                    (failed, failure) = (Some(step.to(target - passed)), reason);
                }
            }
        }
        Err(self.not_converged(failed.map_or(0.0, Step::fraction), failure))
    }

    fn progress(&self, failed: Option<Step>) -> Progress<'_> {
        let RunState { clock, taken, past, curve, .. } = &self.state;
        let moved = past.step().unwrap_or(0.0);
        Progress { passed: *clock, curve, taken: *taken, moved, failed }
    }

    /// Adds the state to the curve, checks whether the run has ended, and saves.
    fn record(&mut self) -> Result<CurvePoint, FemError> {
        if let Some(whole) = &mut self.whole {
            *whole = gather_fields(self.problem.discretisation.operator.part(), &self.state.fields);
        }
        let state = &mut self.state;
        let point = state.point;
        state.curve.push(point);
        let derivatives = &mut state.derivatives;
        if !derivatives.values.is_empty() {
            derivatives.curve.push(derivatives.force_n.clone());
        }
        for (surface, &force) in &state.reaction {
            state.reactions.entry(surface.clone()).or_default().push(force);
        }
        // absolute value, because the force of a body in tension is negative
        state.peak = state.peak.max(point.force_n.abs());
        // the counters restart for the next point
        (state.point.newton, state.point.linear) = (0, 0);
        let below = |fraction| point.force_n.abs() < (1.0 - fraction) * state.peak;
        if self.problem.parts.schedule.stop_below_peak.is_some_and(below) {
            self.end = Some(End::BelowPeak);
        } else if state.clock >= 1.0 {
            self.end = Some(End::Displacement);
        } else {
            self.save()?;
        }
        Ok(point)
    }

    /// Saves the state when due, and discards the data that the solver reuses from step to step. An uninterrupted run
    /// and a resumed run therefore take the same steps.
    fn save(&mut self) -> Result<(), FemError> {
        let Some((checkpoint, fingerprint)) = &self.checkpoint else { return Ok(()) };
        if self.state.curve.len().is_multiple_of(checkpoint.every as usize) {
            self.state.effort = self.solver.effort;
            let saved = match self.whole {
                None => checkpoint.save(&self.state, *fingerprint),
                Some(_) => {
                    let state = self.state.gathered(&self.problem.discretisation);
                    let first = self.ranks().is_first();
                    if first { checkpoint.save(&state, *fingerprint) } else { Ok(()) }
                }
            };
            self.ranks().agreed(saved)?;
            self.solver = self.problem.solver();
            self.solver.resume(self.state.effort);
            self.solver.scales = self.state.scales;
        }
        Ok(())
    }

    fn not_converged(&self, step: f64, source: StepFailure) -> FemError {
        let duration_s = self.problem.parts.schedule.duration_s;
        FemError::NotConverged {
            displacement_mm: self.state.point.displacement_mm,
            time_s: self.state.clock * duration_s,
            step_s: step * duration_s,
            source,
            help: self.advice(source),
        }
    }
}
