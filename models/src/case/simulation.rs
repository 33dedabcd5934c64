//! The test, and the output of a single simulation.

use std::sync::Arc;

use fem::{AdaptiveSteps, ArcLength, FixedSteps, Friction, Platens, Schedule, StepController};
use serde::{Deserialize, Serialize};

/// `[test]`: the top platen moves down at constant speed, unless [`ConditionsCase`](crate::ConditionsCase) replaces the
/// platens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestCase {
    /// Displacement of the top platen at the end of the test in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_mm: Option<f64>,
    /// Duration of the test in s.
    #[serde(default = "one_second")]
    pub duration_s: f64,
    /// Number of equal load steps; without it, the step size is adaptive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// First and largest step of an adaptive step size, as fractions of the displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveCase>,
    /// Settings of the arc-length method, which follows a snap-back of rate-independent damage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_length: Option<ArcLengthCase>,
    /// Contact between platens and specimen; the following keys give the friction.
    #[serde(default)]
    pub platens: Platens,
    /// Coulomb's friction coefficient of unilateral platens.
    #[serde(default)]
    pub friction: f64,
    /// Sliding velocity in mm/s below which Coulomb friction is regularised: it then decreases to zero with the
    /// velocity.
    #[serde(default = "slip_velocity")]
    pub slip_velocity_mm_per_s: f64,
    /// Viscous drag of unilateral platens in MPa s/mm.
    #[serde(default)]
    pub drag_mpa_s_per_mm: f64,
    /// Relative drop of the force below its peak at which the simulation stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_below_peak: Option<f64>,
}

/// `test.adaptive`: limits of the adaptive step size, as fractions of the displacement at the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveCase {
    /// First step, as a fraction of the displacement at the end.
    pub first: f64,
    /// Largest step, as a fraction of the displacement at the end.
    pub largest: f64,
}

/// `test.arc_length`: settings of the arc-length method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcLengthCase {
    /// Largest step of the platen, as a fraction of the displacement at the end.
    pub step: f64,
    /// Largest increase of the crack energy in one step, N mm.
    pub release_n_mm: f64,
}

/// `[output]`: files that a single simulation writes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputCase {
    /// Number of load steps between two files of fields; 0 writes none.
    pub fields_every: u32,
    /// Number of load steps between two pictures of the damage; 0 makes none.
    pub pictures_every: u32,
    /// Number of load steps between two saved states; 0 saves none.
    pub checkpoint_every: u32,
}

impl Default for TestCase {
    /// A table without keys.
    fn default() -> Self {
        Self {
            displacement_mm: None,
            duration_s: one_second(),
            steps: None,
            adaptive: None,
            arc_length: None,
            platens: Platens::default(),
            friction: 0.0,
            slip_velocity_mm_per_s: slip_velocity(),
            drag_mpa_s_per_mm: 0.0,
            stop_below_peak: None,
        }
    }
}

impl TestCase {
    /// Whether no key of the table is given.
    pub(crate) fn is_absent(&self) -> bool {
        *self == Self::default()
    }

    /// Returns duration, step control and stopping criterion of the test.
    pub(crate) fn schedule(&self) -> Schedule {
        Schedule {
            duration_s: self.duration_s,
            steps: self.steps_by(),
            stop_below_peak: self.stop_below_peak,
        }
    }

    fn steps_by(&self) -> Arc<dyn StepController> {
        match (self.steps, self.adaptive, self.arc_length) {
            (Some(steps), ..) => Arc::new(FixedSteps(steps)),
            (_, Some(AdaptiveCase { first, largest }), _) => {
                Arc::new(AdaptiveSteps { first, largest })
            }
            (.., Some(ArcLengthCase { step, release_n_mm })) => {
                Arc::new(ArcLength { step, release_n_mm })
            }
            _ => Arc::new(AdaptiveSteps::default()),
        }
    }

    /// Returns the platens with their friction.
    pub(crate) fn platens(&self) -> Platens {
        match self.platens {
            Platens::Sliding => Platens::Sliding,
            Platens::Unilateral(_) => Platens::Unilateral(Friction {
                coefficient: self.friction,
                slip_velocity_mm_per_s: self.slip_velocity_mm_per_s,
                drag_mpa_s_per_mm: self.drag_mpa_s_per_mm,
            }),
        }
    }
}

impl Default for OutputCase {
    fn default() -> Self {
        Self { fields_every: 1, pictures_every: 0, checkpoint_every: 10 }
    }
}

fn one_second() -> f64 {
    1.0
}

fn slip_velocity() -> f64 {
    1e-3
}
