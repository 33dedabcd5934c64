//! Loop over the load steps, advanced step by step by the caller.

use std::collections::BTreeMap;
use std::fmt;

use super::advice::advice;
use super::increment::Increments;
use crate::error::{FemError, StepFailure};
use crate::fields::Fields;
use crate::parallel::{RankLost, guarded};
use crate::problem::control::{Progress, Step, is_later};
use crate::problem::curve::{CurvePoint, End, Outcome, Sensitivities};
use crate::problem::definition::Setup;
use crate::problem::state::{Checkpoint, Derivatives, RunState, gather_fields};
use crate::solve::Effort;

/// Largest number of steps that are tried for one point of the curve, with any controller.
const MOST_TRIES: u32 = 10_000;
/// Smallest load step towards a force that the specimen does not carry, as a fraction of the segment of the load program.
/// If this step finds no equilibrium, the last equilibrium is the limit.
const LIMIT_RESOLUTION: f64 = 1e-3;

/// Run in progress, advanced one load step at a time; created by [`Problem::start`](crate::Problem::start).
///
/// A step without equilibrium is reduced. [`step`](Self::step) returns `None` once the run has ended. Then
/// [`finish`](Self::finish) returns the curve and the reason for the end; after a failure it returns the curve up to the
/// failure.
///
/// # Example
/// ```
/// use fem::{CompressionTest, CylinderLattice, End, Material, Schedule};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let problem = CompressionTest::new(0.22, Schedule::fixed(1.0, 4))
///     .builder(mesh)?
///     .materials([Material::hencky(275.0, 0.25)])
///     .build()?;
/// let mut run = problem.start();
/// while let Some(point) = run.step() {
///     let lowest = run.fields().displacement.iter().map(|u| u[2]).fold(0.0, f64::min);
///     assert!((lowest + point.displacement_mm).abs() < 1e-12);
/// }
/// let outcome = run.finish();
/// assert!(matches!(outcome.end, End::Displacement));
/// assert_eq!(outcome.curve.len(), 4);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct LoadStepper<'a> {
    increments: Increments<'a>,
    /// Fields of the whole body at the last point, if this rank has only a part of the body.
    whole: Option<Fields>,
    /// File for the state, and the fingerprint of the problem.
    checkpoint: Option<(Checkpoint, u64)>,
    end: Option<End>,
}

impl fmt::Debug for LoadStepper<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RunState { point, curve, .. } = &self.increments.state;
        f.debug_struct("LoadStepper")
            .field("steps", &curve.len())
            .field("point", point)
            .field("end", &self.end)
            .finish_non_exhaustive()
    }
}

impl<'a> LoadStepper<'a> {
    /// Creates a run from the unloaded body.
    pub(crate) fn new(setup: &'a Setup) -> Self {
        let part = setup.discretisation.operator.part();
        let whole = (!part.is_whole()).then(|| Fields::zero(part.all_nodes));
        Self { increments: Increments::new(setup), whole, checkpoint: None, end: None }
    }

    /// Creates a run that saves its state. The run starts from the saved state if the file exists.
    pub(crate) fn resume(setup: &'a Setup, checkpoint: &Checkpoint) -> Result<Self, FemError> {
        checkpoint.validate()?;
        let fingerprint = setup.definition.fingerprint();
        let mut run = Self::new(setup);
        run.checkpoint = Some((checkpoint.clone(), fingerprint));
        let loaded = guarded(|| checkpoint.load(fingerprint, run.increments.ranks()));
        if let Some(state) = loaded.map_err(|lost| run.lost(lost))?? {
            if let Some(whole) = &mut run.whole {
                *whole = state.fields.clone();
            }
            run.increments.state = state.of_part(&setup.discretisation);
            run.increments.renew_solver();
            run.increments.renew_contact();
        }
        Ok(run)
    }

    /// Returns the error of a run in which another rank has ended.
    fn lost(&self, RankLost(rank): RankLost) -> FemError {
        let saved = self.checkpoint.as_ref().map(|(checkpoint, _)| &checkpoint.path);
        FemError::RankLost { rank, checkpoint: saved.filter(|path| path.is_file()).cloned() }
    }

    /// Whether any rank wants to stop the run now; `this_rank` is the decision of this rank.
    pub(crate) fn stops(&mut self, this_rank: bool) -> bool {
        match guarded(|| self.increments.ranks().any(this_rank)) {
            Ok(stop) => stop,
            Err(lost) => {
                self.end = Some(End::Failed(self.lost(lost)));
                true
            }
        }
    }

    /// Takes the next load step; `None` once the run has ended. [`finish`](Self::finish) returns the reason for the end.
    pub fn step(&mut self) -> Option<CurvePoint> {
        if self.end.is_some() {
            return None;
        }
        match guarded(|| self.next_point()).unwrap_or_else(|lost| Err(self.lost(lost))) {
            Ok(point) => Some(point),
            Err(FemError::NotConverged { source, .. }) if source.exceeds_limit_load() => {
                // the last equilibrium may lie between two requested points of the curve
                let clock_s = self.increments.state.point.time_s;
                let is_recorded = self.curve().last().is_none_or(|last| last.time_s >= clock_s);
                let point = (!is_recorded).then(|| self.record());
                self.end = Some(End::LimitLoad);
                point
            }
            Err(error) => {
                self.end = Some(End::Failed(error));
                None
            }
        }
    }

    /// Returns the fields of the whole body at the last point of the curve; the fields are zero
    /// before the first point.
    pub fn fields(&self) -> &Fields {
        self.whole.as_ref().unwrap_or(&self.increments.state.fields)
    }

    /// Returns the points of the curve so far, including the points before a resumption.
    pub fn curve(&self) -> &[CurvePoint] {
        &self.increments.state.curve
    }

    /// Returns the derivatives of force and displacement at the points of the curve so far.
    pub fn sensitivities(&self) -> Sensitivities {
        let names =
            self.increments.setup.definition.parameters.iter().map(|p| p.name.clone()).collect();
        let Derivatives { curve, platen_curve, lost, .. } = &self.increments.state.derivatives;
        let displacement_mm = platen_curve.clone();
        Sensitivities { names, force_n: curve.clone(), displacement_mm, lost: lost.clone() }
    }

    /// Returns the counters of the work that the solver has done so far.
    pub fn effort(&self) -> Effort {
        self.increments.effort()
    }

    /// Returns the name of the hardware that solves the linear systems: a device, or the processor.
    pub fn machine(&self) -> String {
        self.increments.solver.newton.machine()
    }

    /// Returns the curve, the reason for the end and the other results of the run. A run that has not ended yet gets
    /// the reason [`End::Interrupted`].
    pub fn finish(mut self) -> Outcome {
        let Increments { setup, state, accepted, .. } = &self.increments;
        let boundary = &setup.discretisation.boundary;
        let contact_points = || accepted.contact_points(boundary, &state.fields);
        // if a rank has ended, its contact points are not available
        let contact = match &self.end {
            Some(End::Failed(FemError::RankLost { .. })) => BTreeMap::new(),
            _ => guarded(contact_points).unwrap_or_else(|lost| {
                self.end = Some(End::Failed(self.lost(lost)));
                BTreeMap::new()
            }),
        };
        let (sensitivities, machine, effort) =
            (self.sensitivities(), self.machine(), self.effort());
        let RunState { curve, fields, reactions, .. } = self.increments.state;
        let fields = self.whole.unwrap_or(fields);
        let end = self.end.unwrap_or(End::Interrupted);
        let values = BTreeMap::new();
        Outcome { curve, sensitivities, values, end, fields, reactions, contact, effort, machine }
    }

    /// Takes steps until the next point of the curve is reached.
    fn next_point(&mut self) -> Result<CurvePoint, FemError> {
        let schedule = &self.increments.setup.definition.schedule;
        let controller = &schedule.steps;
        let mark = controller.next_mark(&self.progress(None));
        let (mut failed, mut failure) = (None, StepFailure::GivenUp);
        for _ in 0..MOST_TRIES {
            let passed = self.increments.state.clock;
            let Some(step) = controller.next(&self.progress(failed)) else { break };
            step.validate(controller.controls_crack_energy())?;
            if failed.is_some() {
                self.increments.count_cut();
            }
            let corner = schedule.next_corner(passed);
            // a corner that differs from the mark by a rounding error is at the mark
            let limit = mark.filter(|&mark| !is_later(mark, corner)).unwrap_or(corner);
            // extend the step to the limit if the remaining distance to the limit would be less than 1 % of the step
            let reaches = passed + 1.01 * step.fraction() >= limit;
            let target = if reaches { limit } else { passed + step.fraction() };
            let before = self.increments.effort();
            match self.increments.take(step, target) {
                Ok(()) => {
                    (self.increments.state.taken, failed) = (Some(step), None);
                    if mark.is_none_or(|mark| target >= mark) {
                        return Ok(self.record());
                    }
                }
                Err(reason) => {
                    let Effort { iterations, linear, .. } = self.increments.effort();
                    self.increments.state.point.newton += iterations - before.iterations;
                    self.increments.state.point.linear += linear - before.linear;
                    (failed, failure) = (Some(step.to(target - passed)), reason);
                    let segment = corner - schedule.last_corner(passed);
                    if reason.exceeds_limit_load() && target - passed <= LIMIT_RESOLUTION * segment
                    {
                        break;
                    }
                }
            }
        }
        Err(self.not_converged(failed.map_or(0.0, Step::fraction), failure))
    }

    fn progress(&self, failed: Option<Step>) -> Progress<'_> {
        let RunState { clock, taken, past, curve, .. } = &self.increments.state;
        let moved = past.step().unwrap_or(0.0);
        Progress { passed: *clock, curve, taken: *taken, moved, failed }
    }

    /// Adds the point of the current state to the curve, checks whether the run has ended, and saves the state if a
    /// save is due.
    fn record(&mut self) -> CurvePoint {
        if let Some(whole) = &mut self.whole {
            *whole = gather_fields(
                self.increments.setup.discretisation.operator.part(),
                &self.increments.state.fields,
            );
        }
        let state = &mut self.increments.state;
        let point = state.point;
        let farthest = state.curve.iter().map(|p| p.displacement_mm.abs()).fold(0.0, f64::max);
        state.curve.push(point);
        let derivatives = &mut state.derivatives;
        if !derivatives.values.is_empty() {
            derivatives.curve.push(derivatives.force_n.clone());
            if !derivatives.platen_mm.is_empty() {
                derivatives.platen_curve.push(derivatives.platen_mm.clone());
            }
        }
        for (surface, &force) in &state.reaction {
            state.reactions.entry(surface.clone()).or_default().push(force);
        }
        // the force is negative in tension: compare absolute values
        state.peak = state.peak.max(point.force_n.abs());
        // restart the counters of iterations for the next point
        (state.point.newton, state.point.linear) = (0, 0);
        let schedule = &self.increments.setup.definition.schedule;
        let moves_on = schedule.corners_s.is_empty() || point.displacement_mm.abs() > farthest;
        let counts = moves_on && !schedule.prescribes_force_at(state.clock);
        let below = |fraction| counts && point.force_n.abs() < (1.0 - fraction) * state.peak;
        if schedule.stop_below_peak.is_some_and(below) {
            self.end = Some(End::BelowPeak);
        } else if state.clock >= 1.0 {
            self.end = Some(End::Displacement);
        } else if let Err(error) = self.save() {
            self.end = Some(End::Failed(error));
        }
        point
    }

    /// Saves the state if a save is due, and discards the tangents and factors that the solver reuses from step to
    /// step.
    ///
    /// This data is discarded because a resumed run does not have it: an uninterrupted run then continues exactly like
    /// a resumed run.
    fn save(&mut self) -> Result<(), FemError> {
        let Some((checkpoint, fingerprint)) = &self.checkpoint else { return Ok(()) };
        if self.increments.state.curve.len().is_multiple_of(checkpoint.every as usize) {
            self.increments.state.effort = self.increments.effort();
            let saved = match self.whole {
                None => checkpoint.save(&self.increments.state, *fingerprint),
                Some(_) => {
                    let state =
                        self.increments.state.gathered(&self.increments.setup.discretisation);
                    let first = self.increments.ranks().is_first();
                    if first { checkpoint.save(&state, *fingerprint) } else { Ok(()) }
                }
            };
            self.increments.ranks().agreed(saved)?;
            self.increments.renew_solver();
        }
        Ok(())
    }

    fn not_converged(&self, step: f64, source: StepFailure) -> FemError {
        let duration_s = self.increments.setup.definition.schedule.duration_s;
        FemError::NotConverged {
            displacement_mm: self.increments.state.point.displacement_mm,
            time_s: self.increments.state.clock * duration_s,
            step_s: step * duration_s,
            source,
            help: advice(&self.increments, source),
        }
    }
}
