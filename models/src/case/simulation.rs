//! The test, and what a single simulation leaves behind.

use std::sync::Arc;

use fem::{AdaptiveSteps, ArcLength, FixedSteps, Friction, Platens, Schedule, StepController};
use serde::{Deserialize, Serialize};

/// `[test]`: the top platen moves down at constant speed, unless [`ConditionsCase`](crate::ConditionsCase)
/// says what acts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestCase {
    /// Displacement of the platen at the end in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_mm: Option<f64>,
    /// Time that it takes in s.
    #[serde(default = "one_second")]
    pub duration_s: f64,
    /// Number of equal load steps; without it they adapt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// First and largest adaptive step, as fractions of the displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveCase>,
    /// Follow a snap-back of rate-independent damage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_length: Option<ArcLengthCase>,
    /// How the platens hold the specimen; the numbers of their friction follow.
    #[serde(default)]
    pub platens: Platens,
    /// Coulomb's coefficient of unilateral platens.
    #[serde(default)]
    pub friction: f64,
    /// Velocity in mm/s below which friction fades into creep.
    #[serde(default = "slip_velocity")]
    pub slip_velocity_mm_per_s: f64,
    /// Viscous drag of unilateral platens in MPa s/mm.
    #[serde(default)]
    pub drag_mpa_s_per_mm: f64,
    /// Stop once the force is this fraction below its peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_below_peak: Option<f64>,
}

/// `test.adaptive`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveCase {
    /// First step.
    pub first: f64,
    /// Largest step.
    pub largest: f64,
}

/// `test.arc_length`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcLengthCase {
    /// Largest step of the platen, as a fraction of the displacement.
    pub step: f64,
    /// Crack energy in N mm that a step may add.
    pub release_n_mm: f64,
}

/// `[output]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputCase {
    /// Load steps from one file of fields to the next; zero writes none.
    pub fields_every: u32,
    /// Load steps from one picture of the damage to the next; zero makes none.
    pub pictures_every: u32,
    /// Load steps from one saved state to the next; zero saves none.
    pub checkpoint_every: u32,
}

impl TestCase {
    /// The time and the steps through it.
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

    /// The platens with the numbers of their friction.
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
