//! Step controllers, which choose the length of the next load step.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{FemError, Unsupported};
use crate::problem::curve::CurvePoint;

/// A step from one equilibrium to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Step {
    /// Advances by this fraction of the schedule's duration.
    Advance(f64),
    /// Advances by `fraction` of the schedule's duration, by Newton's method on both fields without fallback, and
    /// fails if the step adds more than `most_n_mm` to the crack energy.
    AdvanceWithin {
        /// Fraction of the duration.
        fraction: f64,
        /// Largest allowed increase of the crack energy, N mm.
        most_n_mm: f64,
    },
    /// Adds `n_mm` to the crack energy. The fraction of the duration by which the step advances, and thus the position
    /// of the loaded ends, is an unknown.
    Release {
        /// Increase of the crack energy, N mm.
        n_mm: f64,
        /// Initial guess of the change of the position of the loaded ends, as a fraction of the duration; negative for
        /// a step back.
        guess: f64,
    },
}

impl Step {
    /// Returns the fraction of the duration by which the step advances: the requested fraction, or the guess of a
    /// `Release`.
    pub fn fraction(self) -> f64 {
        match self {
            Step::Advance(fraction) | Step::AdvanceWithin { fraction, .. } => fraction,
            Step::Release { guess, .. } => guess,
        }
    }

    /// Returns the step with another fraction of the duration. A `Release` is unchanged.
    pub(crate) fn to(self, fraction: f64) -> Self {
        match self {
            Step::Advance(_) => Step::Advance(fraction),
            Step::AdvanceWithin { most_n_mm, .. } => Step::AdvanceWithin { fraction, most_n_mm },
            Step::Release { .. } => self,
        }
    }

    /// Checks that the step is valid. Steps that limit or prescribe the crack energy are allowed only if `by_energy` is
    /// true.
    pub(crate) fn validate(self, by_energy: bool) -> Result<(), FemError> {
        let (field, value) = match self {
            Step::Advance(fraction) => ("step", fraction),
            Step::AdvanceWithin { fraction, .. } => ("step", fraction),
            Step::Release { n_mm, .. } => ("release_n_mm", n_mm),
        };
        if !(value > 0.0 && value.is_finite() && self.fraction().is_finite()) {
            let requirement = "positive and finite at every state of the run";
            return Err(FemError::parameter("step controller", field, value, requirement));
        }
        if !(by_energy || matches!(self, Step::Advance(_))) {
            let reason = Unsupported::UnannouncedRelease;
            return Err(FemError::unsupported("step controller", reason));
        }
        Ok(())
    }
}

/// State of a run when it requests the next step.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress<'a> {
    /// Fraction of the duration that has been completed.
    pub passed: f64,
    /// Points of the curve so far.
    pub curve: &'a [CurvePoint],
    /// The request of the last step that reached an equilibrium.
    pub taken: Option<Step>,
    /// Fraction of the duration by which the step `taken` actually advanced; negative for a step back.
    pub moved: f64,
    /// The step from the current state that has just failed; `None` after a successful step.
    pub failed: Option<Step>,
}

/// Decides on the load steps of a run: [`FixedSteps`](crate::FixedSteps),
/// [`AdaptiveSteps`](crate::AdaptiveSteps), [`ArcLength`](crate::ArcLength), or a user-defined type.
///
/// A controller has no state: all information is in [`Progress`]. The `Debug` output of a controller is part of the
/// fingerprint of a checkpoint and must therefore contain all settings.
///
/// # Example
/// Long steps while the specimen is elastic, short steps once its stiffness decreases:
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
    /// Returns the next step to try; `None` ends the run with the error of the failed step.
    ///
    /// The run shortens a step that would pass the end or the next mark, see [`marks`](Self::marks).
    fn next(&self, run: &Progress) -> Option<Step>;

    /// Returns the number of *marks*: points of the curve that are equally spaced in time, independent of the steps
    /// between the points. Returns `None` if each step is a point of the curve.
    fn marks(&self) -> Option<u32> {
        None
    }

    /// Returns the position of the next point of the curve, as a fraction of the duration; `None` if each step is a
    /// point of the curve. The default implementation computes the position from [`marks`](Self::marks).
    fn next_mark(&self, run: &Progress) -> Option<f64> {
        let next = (run.curve.len() + 1) as f64;
        self.marks().map(|marks| next / f64::from(marks))
    }

    /// Whether the controller uses steps that limit or prescribe the crack energy: [`Step::AdvanceWithin`] and
    /// [`Step::Release`]. If true, problems without rate-independent damage and problems with loads or platens are
    /// rejected.
    fn controls_crack_energy(&self) -> bool {
        false
    }

    /// Checks that the settings are valid.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the allowed values.
    fn validate(&self) -> Result<(), FemError> {
        Ok(())
    }
}
