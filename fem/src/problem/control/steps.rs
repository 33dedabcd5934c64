//! The built-in step controllers: fixed, adaptive and arc-length steps.

use super::controller::{Progress, Step, StepController};
use crate::error::FemError;

/// Factor by which the step size grows after a converged step.
pub(super) const GROWTH: f64 = 1.5;
/// Factor by which the step size is reduced after a failed step.
pub(super) const CUT: f64 = 0.5;
/// Smallest step, as a fraction of the duration; in a load program, of the duration of the segment.
pub(super) const LEAST: f64 = 1e-6;
/// A step with prescribed displacement of the platen that fails or adds too much crack energy is reduced by at most
/// this factor. If the reduced step fails too, the next step prescribes the increase of the crack energy instead.
const CUTS: f64 = 64.0;
/// Smallest prescribed increase of the crack energy, as a fraction of `release_n_mm`.
const LEAST_RELEASE: f64 = 1e-4;

/// Equal steps. A step that finds no equilibrium is divided, but the curve contains only the points at the requested
/// steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedSteps(
    /// Number of steps.
    pub u32,
);

/// Steps that grow after convergence and are reduced after a failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveSteps {
    /// First step, as a fraction of the duration.
    pub first: f64,
    /// Largest step, as a fraction of the duration; limits the error in time.
    pub largest: f64,
}

/// Steps that follow the equilibrium through a snap-back of rate-independent damage.
///
/// If a step of the platen would increase the crack energy by more than `release_n_mm`, the increase of the crack
/// energy is prescribed instead, and the displacement of the platen is an unknown; the platen may move backwards. Time
/// is proportional to the displacement, so that time may decrease too. Requires a damage model that follows from an
/// energy, no viscosity, and `stop_below_peak`, because the platen may never reach the full displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcLength {
    /// Largest step of the platen, as a fraction of the full displacement.
    pub step: f64,
    /// Largest increase of the crack energy in a step, N mm.
    pub release_n_mm: f64,
}

impl Default for AdaptiveSteps {
    /// The first step is a hundredth of the duration, the largest step a fortieth.
    fn default() -> Self {
        Self { first: 0.01, largest: 0.025 }
    }
}

/// Returns a step that grows after an equilibrium, up to `largest`, and is reduced after a failure.
fn adapt(run: &Progress, first: f64, largest: f64) -> Option<Step> {
    let fraction = match (run.failed, run.taken) {
        (Some(failed), _) if failed.fraction() <= LEAST => return None,
        (Some(failed), _) => CUT * failed.fraction(),
        (None, Some(taken)) => largest.min(GROWTH * taken.fraction()),
        (None, None) => first,
    };
    Some(Step::Advance(fraction))
}

pub(super) fn check(
    holds: bool,
    field: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), FemError> {
    if holds { Ok(()) } else { Err(FemError::parameter("test", field, value, requirement)) }
}

fn check_fraction(field: &'static str, value: f64) -> Result<(), FemError> {
    let requirement = "a fraction of the displacement, in (0, 1]";
    check(value > 0.0 && value <= 1.0, field, value, requirement)
}

impl StepController for FixedSteps {
    fn next(&self, run: &Progress) -> Option<Step> {
        let step = 1.0 / f64::from(self.0);
        adapt(run, step, step)
    }

    fn marks(&self) -> Option<u32> {
        Some(self.0)
    }

    fn validate(&self) -> Result<(), FemError> {
        let requirement = "at least 1; omit `steps` for adaptive steps";
        check(self.0 > 0, "steps", f64::from(self.0), requirement)
    }
}

impl StepController for AdaptiveSteps {
    fn next(&self, run: &Progress) -> Option<Step> {
        adapt(run, self.first, self.largest)
    }

    fn validate(&self) -> Result<(), FemError> {
        check_fraction("first", self.first)?;
        let requirement = "a fraction of the displacement, not below the first step";
        check(
            self.largest >= self.first && self.largest <= 1.0,
            "largest",
            self.largest,
            requirement,
        )
    }
}

impl StepController for ArcLength {
    fn next(&self, run: &Progress) -> Option<Step> {
        let (largest, most_n_mm) = (self.step, self.release_n_mm);
        let within = |fraction| Some(Step::AdvanceWithin { fraction, most_n_mm });
        let release = |n_mm: f64| {
            let guess = match run.taken {
                Some(Step::Release { n_mm: last, .. }) => n_mm / last * run.moved,
                // initial guess: a small forward step of the platen from the last state before
                // damage grows
                _ => largest / CUTS,
            };
            Some(Step::Release { n_mm, guess })
        };
        match (run.failed, run.taken) {
            (Some(Step::Release { n_mm, .. }), _) if n_mm <= LEAST_RELEASE * most_n_mm => None,
            (Some(Step::Release { n_mm, .. }), _) => release(CUT * n_mm),
            (Some(step), _) if step.fraction() > largest / CUTS => within(CUT * step.fraction()),
            (Some(_), _) => release(most_n_mm),
            // the last step of prescribed crack energy moved the platen far, so that the response is nearly elastic
            // again: prescribe the displacement
            (None, Some(Step::Release { .. })) if run.moved > largest => within(largest),
            (None, Some(Step::Release { n_mm, .. })) => release(most_n_mm.min(GROWTH * n_mm)),
            (None, Some(step)) => within(largest.min(GROWTH * step.fraction())),
            (None, None) => within(largest),
        }
    }

    fn controls_crack_energy(&self) -> bool {
        true
    }

    fn validate(&self) -> Result<(), FemError> {
        check_fraction("step", self.step)?;
        check(
            self.release_n_mm > 0.0 && self.release_n_mm.is_finite(),
            "release_n_mm",
            self.release_n_mm,
            "a positive energy in N mm, such as a fiftieth of the toughness times the cross-section",
        )
    }
}
