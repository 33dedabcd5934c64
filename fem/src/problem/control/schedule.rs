//! The duration of a problem and its load steps.

use std::sync::Arc;

use super::clock::{SAME, is_later};
use super::controller::StepController;
use super::program::{LoadProgram, PlatenLoad};
use super::program_steps::SegmentSteps;
use super::steps::{AdaptiveSteps, FixedSteps, check};
use crate::boundary::Conditions;
use crate::error::{FemError, Unsupported};
use crate::material::{Material, PhaseField};

/// Duration of a problem, its load steps, and the criterion for an early end.
#[derive(Clone, Debug)]
pub struct Schedule {
    /// Time at the end, s.
    pub duration_s: f64,
    /// Controller that chooses the load steps.
    pub steps: Arc<dyn StepController>,
    /// Fraction of the peak force below which the run stops: 0.1 stops at 90 % of the peak. With corners, the criterion
    /// applies only while the displacement exceeds all earlier displacements, and not during hold, unloading and
    /// reloading, and never where the force is prescribed.
    pub stop_below_peak: Option<f64>,
    /// Times at which the speed of the load changes (*corners*), s, in ascending order, without start and end. A load
    /// step ends at each corner, and the initial guess of the next step is not extrapolated.
    pub corners_s: Vec<f64>,
    /// Load program of the platen, if the program prescribes a force. The conditions then contain this platen, see
    /// [`CompressionTest`](crate::CompressionTest).
    pub force_program: Option<LoadProgram>,
}

impl Schedule {
    /// Creates a schedule with the steps of a controller.
    pub fn new(duration_s: f64, steps: impl StepController + 'static) -> Self {
        Self {
            duration_s,
            steps: Arc::new(steps),
            stop_below_peak: None,
            corners_s: Vec::new(),
            force_program: None,
        }
    }

    /// Creates a schedule with equal steps: [`FixedSteps`].
    pub fn fixed(duration_s: f64, steps: u32) -> Self {
        Self::new(duration_s, FixedSteps(steps))
    }

    /// Creates a schedule with [`AdaptiveSteps`].
    pub fn adaptive(duration_s: f64) -> Self {
        Self::new(duration_s, AdaptiveSteps::default())
    }

    /// Creates the schedule of a load program: its duration, its corners, and its steps.
    pub fn of_program(program: &LoadProgram, usual: SegmentSteps) -> Self {
        let corners_s = program.corners_s();
        let force_program = program.prescribes_force().then(|| program.clone());
        Self { corners_s, force_program, ..Self::new(program.duration_s(), program.steps(usual)) }
    }

    /// Returns the position of the first corner after `passed`, or the position of the end if no corner
    /// follows. Positions are fractions of the duration.
    pub(crate) fn next_corner(&self, passed: f64) -> f64 {
        let corners = self.corners_s.iter().map(|time_s| time_s / self.duration_s);
        corners.filter(|&corner| is_later(corner, passed)).fold(1.0, f64::min)
    }

    /// Returns the position of the last corner at or before `passed`, or the start if there is none. Positions are
    /// fractions of the duration.
    pub(crate) fn last_corner(&self, passed: f64) -> f64 {
        let corners = self.corners_s.iter().map(|time_s| time_s / self.duration_s);
        corners.filter(|&corner| !is_later(corner, passed)).fold(0.0, f64::max)
    }

    /// Whether the load has a corner at a position, given as a fraction of the duration.
    pub(crate) fn is_corner(&self, position: f64) -> bool {
        let is_here = |time_s: &f64| (time_s / self.duration_s - position).abs() <= SAME;
        self.corners_s.iter().any(is_here)
    }

    /// Whether the force of the platen is prescribed at a position, given as a fraction of the duration.
    pub(crate) fn prescribes_force_at(&self, position: f64) -> bool {
        let load = |program: &LoadProgram| program.load_at(position * self.duration_s, [0.0; 2]);
        matches!(self.force_program.as_ref().map(load), Some(PlatenLoad::Force(_)))
    }

    /// Distance of a position from the last corner before it; infinite if no corner is before it. Positions are fractions
    /// of the duration.
    pub(crate) fn since_corner(&self, position: f64) -> f64 {
        let corners = self.corners_s.iter().map(|time_s| time_s / self.duration_s);
        let distances = corners.filter(|&corner| !is_later(corner, position));
        distances.map(|corner| position - corner).fold(f64::INFINITY, f64::min)
    }

    /// Stops the run once the force has fallen below its peak by this fraction.
    pub fn stop_below_peak(self, fraction: f64) -> Self {
        Self { stop_below_peak: Some(fraction), ..self }
    }

    /// Checks that duration and steps are valid.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`].
    pub fn validate(&self) -> Result<(), FemError> {
        check(
            self.duration_s > 0.0 && self.duration_s.is_finite(),
            "duration_s",
            self.duration_s,
            "a positive time in s",
        )?;
        if let Some(fraction) = self.stop_below_peak {
            check(
                fraction > 0.0 && fraction < 1.0,
                "stop_below_peak",
                fraction,
                "between 0 and 1, for example 0.1 for 10 %",
            )?;
        }
        let ascends = self.corners_s.windows(2).all(|pair| pair[0] < pair[1]);
        let inside = |time_s: &f64| *time_s > 0.0 && *time_s < self.duration_s;
        let outside = self.corners_s.iter().copied().find(|time_s| !inside(time_s));
        check(
            ascends && outside.is_none(),
            "corners_s",
            outside.or(self.corners_s.first().copied()).unwrap_or(0.0),
            "in ascending order, after 0 s and before the end",
        )?;
        check(
            self.corners_s.is_empty() || !self.steps.controls_crack_energy(),
            "corners_s",
            self.corners_s.first().copied().unwrap_or(0.0),
            "left out with arc-length steps, for which time is proportional to the displacement",
        )?;
        check(
            self.force_program.is_none() || !self.steps.controls_crack_energy(),
            "force_n",
            0.0,
            "left out with arc-length steps, for which the displacement is an unknown already",
        )?;
        check(
            self.stop_below_peak.is_some() || !self.steps.controls_crack_energy(),
            "stop_below_peak",
            0.0,
            "given with arc-length steps, which may never reach the full displacement",
        )?;
        self.steps.validate()
    }
}

/// Rejects problems that steps of prescribed crack energy do not support.
pub(crate) fn check_crack_energy(
    schedule: &Schedule,
    materials: &[Material],
    field: Option<&PhaseField>,
    conditions: &Conditions,
) -> Result<(), FemError> {
    if !schedule.steps.controls_crack_energy() {
        return Ok(());
    }
    let refuse = |reason| Err(FemError::unsupported("test", reason));
    let damaged = || materials.iter().filter_map(|m| m.fracture);
    if !conditions.only_prescribe() {
        return refuse(Unsupported::ArcLengthWithLoads);
    }
    if field.is_none() || damaged().next().is_none() {
        return refuse(Unsupported::ArcLengthWithoutDamage);
    }
    if field.is_some_and(|f| !f.is_variational()) {
        return refuse(Unsupported::ArcLengthWithoutEnergy);
    }
    if damaged().any(|m| m.viscosity_mpa_s > 0.0) {
        return refuse(Unsupported::ArcLengthWithViscosity);
    }
    if materials.iter().any(|material| material.strength.is_some()) {
        return refuse(Unsupported::ArcLengthWithoutEnergy);
    }
    if materials.iter().any(|material| material.state_len() > 0) {
        return refuse(Unsupported::ArcLengthWithState);
    }
    Ok(())
}
