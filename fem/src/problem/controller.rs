//! Step controllers: what decides how long the next load step is.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::curve::CurvePoint;
use crate::error::FemError;

/// A step from one equilibrium to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Step {
    /// This fraction of the schedule's duration.
    Advance(f64),
    /// The same by Newton's method alone, refused where it adds more to the crack energy than `most_n_mm`.
    AdvanceWithin {
        /// Fraction of the duration.
        fraction: f64,
        /// Crack energy that it may add, N mm.
        most_n_mm: f64,
    },
    /// What adds `n_mm` to the crack energy, wherever the ends must go for that.
    Release {
        /// Crack energy, N mm.
        n_mm: f64,
        /// Where the iteration starts: fraction of the duration from here, back if negative.
        guess: f64,
    },
}

impl Step {
    /// The fraction of the duration that is asked for, or guessed.
    pub fn fraction(self) -> f64 {
        match self {
            Step::Advance(fraction) | Step::AdvanceWithin { fraction, .. } => fraction,
            Step::Release { guess, .. } => guess,
        }
    }

    /// The same step where it ends after a fraction of the duration.
    pub(super) fn to(self, end: f64) -> Self {
        match self {
            Step::Advance(_) => Step::Advance(end),
            Step::AdvanceWithin { most_n_mm, .. } => {
                Step::AdvanceWithin { fraction: end, most_n_mm }
            }
            Step::Release { .. } => self,
        }
    }

    /// Refuses what cannot be taken; `by_energy` says whether steps by crack energy can.
    pub(super) fn validate(self, by_energy: bool) -> Result<(), FemError> {
        let (field, value) = match self {
            Step::Advance(fraction) => ("step", fraction),
            Step::AdvanceWithin { fraction, .. } => ("step", fraction),
            Step::Release { n_mm, .. } => ("release_n_mm", n_mm),
        };
        if !(value > 0.0 && value.is_finite() && self.fraction().is_finite()) {
            let requirement = "positive and finite, whatever the run has come to";
            return Err(FemError::parameter("step controller", field, value, requirement));
        }
        if !(by_energy || matches!(self, Step::Advance(_))) {
            return Err(FemError::unsupported(
                "step controller",
                "it asks for a step by crack energy and does not say so beforehand",
                "let its controls_crack_energy return true, or take Step::Advance",
            ));
        }
        Ok(())
    }
}

/// Where a run stands when it asks for the next step.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress<'a> {
    /// Fraction of the duration that has passed.
    pub passed: f64,
    /// The points so far.
    pub curve: &'a [CurvePoint],
    /// The last step that found its equilibrium, as it was asked for.
    pub taken: Option<Step>,
    /// The fraction of the duration by which that moved, negative where it went back.
    pub moved: f64,
    /// The step that has just found no equilibrium from here.
    pub failed: Option<Step>,
}

/// Decides on the load steps of a run: [`FixedSteps`](crate::FixedSteps),
/// [`AdaptiveSteps`](crate::AdaptiveSteps), [`ArcLength`](crate::ArcLength), or a type of the user.
///
/// A controller remembers nothing: what it needs to know is in [`Progress`]. Its `Debug` output is
/// part of what a checkpoint belongs to, so it shows all its settings.
///
/// # Example
/// Long steps while the specimen is elastic, short ones from where its stiffness fades:
/// ```
/// use fem::{
///     CompressionTest, CylinderLattice, Fracture, Material, PhaseField, Progress, Schedule, Step,
///     StepController,
/// };
///
/// #[derive(Debug)]
/// struct ByStiffness {
///     elastic: f64,
///     softening: f64,
/// }
///
/// impl StepController for ByStiffness {
///     fn next(&self, run: &Progress) -> Option<Step> {
///         if let Some(failed) = run.failed {
///             let half = 0.5 * failed.fraction();
///             return (half > 1e-5).then_some(Step::Advance(half));
///         }
///         let softens = match run.curve {
///             [first, .., before, last] => {
///                 let slope = (last.force_n - before.force_n)
///                     / (last.displacement_mm - before.displacement_mm);
///                 slope < 0.8 * first.force_n / first.displacement_mm
///             }
///             _ => false,
///         };
///         Some(Step::Advance(if softens { self.softening } else { self.elastic }))
///     }
/// }
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
///     toughness_n_per_mm: 0.0025,
///     viscosity_mpa_s: 0.3,
///     residual_stiffness: 0.01,
/// });
/// let steps = ByStiffness { elastic: 0.1, softening: 0.02 };
/// let schedule = Schedule::new(1.0, steps).stop_below_peak(0.05);
/// let outcome = CompressionTest::new(0.22, schedule)
///     .builder(mesh)?
///     .materials([matrix])
///     .phase_field(PhaseField::new(0.06))
///     .build()?
///     .run(&mut ());
/// let moved = |k: usize| outcome.curve[k].displacement_mm - outcome.curve[k - 1].displacement_mm;
/// assert!((moved(1) - 0.022).abs() < 1e-9);
/// assert!((moved(outcome.curve.len() - 1) - 0.0044).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait StepController: fmt::Debug + Send + Sync {
    /// The next step to try; `None` gives the run up with the reason of the failure.
    ///
    /// A step never goes beyond the end or the next of the [`marks`](Self::marks).
    fn next(&self, run: &Progress) -> Option<Step>;

    /// So many points, equally far apart in time, make the curve, however many steps it takes from
    /// one to the next; without them each step is a point.
    fn marks(&self) -> Option<u32> {
        None
    }

    /// Whether it asks for steps by crack energy, which only rate-independent damage under
    /// prescribed displacements can follow; the problem is then refused if it is another.
    fn controls_crack_energy(&self) -> bool {
        false
    }

    /// Refuses settings that no run can take.
    ///
    /// # Errors
    /// [`FemError::Parameter`] with what is accepted.
    fn validate(&self) -> Result<(), FemError> {
        Ok(())
    }
}
