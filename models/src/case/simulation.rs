//! The test, and the output of a single simulation.

use std::sync::Arc;

use fem::{
    AdaptiveSteps, ArcLength, CompressionTest, FemError, FixedSteps, Friction, LoadProgram,
    Platens, Schedule, SegmentSteps, StepController,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::program::ProgramPointCase;
use super::test_kind::TestKindCase;

/// `[test]`: the top platen moves down at constant speed or follows a load program, unless
/// [`ConditionsCase`](crate::case::ConditionsCase) replaces the platens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TestCase {
    /// Kind of the test, if the specimen is not compressed between platens.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<TestKindCase>,
    /// Displacement of the top platen at the end of the test in mm; not allowed with a load
    /// program.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-9, max = 1e3))]
    pub displacement_mm: Option<f64>,
    /// Duration of the test in s; not allowed with a load program. See [`TestCase::duration_s`].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub duration_s: Option<f64>,
    /// Load program of the top platen: displacement or force are linear between these points, and begin at zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub program: Option<Vec<ProgramPointCase>>,
    /// Temperature of the specimen in °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -273.15, max = 5000))]
    pub temperature_celsius: Option<f64>,
    /// Number of equal load steps: of the test, or of each segment of a load program. Without this key, the step size is
    /// adaptive.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = u32::MAX))]
    pub steps: Option<u32>,
    /// First and largest step of an adaptive step size. The steps are fractions of the displacement; with a load program
    /// they are fractions of the duration of a segment.
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
    #[schemars(range(min = 0, max = 10))]
    pub friction: f64,
    /// Sliding velocity in mm/s below which Coulomb friction is regularised: below this velocity, the friction
    /// stress decreases to zero with the velocity.
    #[serde(default = "slip_velocity")]
    #[schemars(range(min = 1e-9, max = 1e6))]
    pub slip_velocity_mm_per_s: f64,
    /// Viscous drag of unilateral platens in MPa s/mm.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e6))]
    pub drag_mpa_s_per_mm: f64,
    /// Relative drop of the force below its peak at which the simulation stops. With a load program, the drop is checked
    /// only while the displacement exceeds all earlier displacements.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub stop_below_peak: Option<f64>,
}

/// `test.adaptive`: limits of the adaptive step size, as fractions of the displacement at the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveCase {
    /// First step, as a fraction of the displacement at the end.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub first: f64,
    /// Largest step, as a fraction of the displacement at the end.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub largest: f64,
}

/// `test.arc_length`: settings of the arc-length method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArcLengthCase {
    /// Largest step of the platen, as a fraction of the displacement at the end.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub step: f64,
    /// Largest increase of the crack energy in one step, N mm.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub release_n_mm: f64,
}

/// `[output]`: files that a single simulation writes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputCase {
    /// Number of load steps between two files of fields; with 0, no files of fields are written.
    pub fields_every: u32,
    /// Number of load steps between two pictures of the damage; with 0, no pictures are drawn.
    pub pictures_every: u32,
    /// Number of load steps between two saved states; with 0, no state is saved.
    pub checkpoint_every: u32,
}

impl Default for TestCase {
    /// A table without keys.
    fn default() -> Self {
        Self {
            kind: None,
            displacement_mm: None,
            duration_s: None,
            program: None,
            temperature_celsius: None,
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
        let usual = Self { duration_s: Some(ONE_SECOND), ..Self::default() };
        *self == Self::default() || *self == usual
    }

    /// Returns the duration of the test in s: the time of the last point of the load program, or the key `duration_s`,
    /// whose default is 1 s.
    pub fn duration_s(&self) -> f64 {
        match self.program.as_deref() {
            Some(program) => program.last().map_or(0.0, |point| point.time_s),
            None => self.duration_s.unwrap_or(ONE_SECOND),
        }
    }

    /// Speed of the platen while it first moves, mm/s; `None` if the platen does not move, or if the load program
    /// prescribes a force at first.
    pub(crate) fn first_speed_mm_per_s(&self) -> Option<f64> {
        let Some(program) = self.program.as_deref() else {
            return Some(self.displacement_mm? / self.duration_s());
        };
        let is_moved = |point: &&ProgramPointCase| point.displacement_mm.is_some();
        let moved = program.iter().take_while(is_moved);
        let ends = moved.map(|point| (point.time_s, point.displacement_mm.unwrap_or(0.0)));
        let starts = [(0.0, 0.0)].into_iter().chain(ends.clone());
        let speeds = starts.zip(ends).map(|(from, to)| (to.1 - from.1) / (to.0 - from.0));
        speeds.into_iter().find(|speed| *speed > 0.0)
    }

    /// Number of equal load steps of the whole test; `None` if the step size is adaptive. `steps` replaces the number
    /// of load steps of the case.
    pub(crate) fn load_steps(&self, steps: Option<u32>) -> Option<u32> {
        let usual = steps.or(self.steps);
        let Some(program) = self.program.as_deref() else { return usual };
        let of_segment = |point: &ProgramPointCase| point.steps.or(usual);
        program.iter().try_fold(0_u32, |sum, point| sum.checked_add(of_segment(point)?))
    }

    /// Inserts the default values that depend on other keys.
    pub(super) fn complete(&mut self) {
        if self.program.is_none() {
            self.duration_s.get_or_insert(ONE_SECOND);
        }
    }

    /// Returns the load program, if the test has one.
    ///
    /// # Errors
    /// If the program is invalid.
    pub(crate) fn load_program(&self) -> Result<Option<LoadProgram>, FemError> {
        let program = self.program.as_deref();
        program
            .map(|program| LoadProgram::new(program.iter().map(ProgramPointCase::in_fem).collect()))
            .transpose()
    }

    /// Returns the test of a specimen between platens. `steps` replaces the number of load steps of the case.
    ///
    /// # Errors
    /// If the load program is invalid.
    pub(crate) fn compression(&self, steps: Option<u32>) -> Result<CompressionTest, FemError> {
        let platens = self.platens();
        if let Some(program) = self.load_program()? {
            let mut test = CompressionTest::following(program, self.segment_steps(steps));
            test.schedule.stop_below_peak = self.stop_below_peak;
            return Ok(test.platens(platens));
        }
        // the validation of the case requires this key for tests with platens
        let displacement_mm = self.displacement_mm.unwrap_or(f64::NAN);
        Ok(CompressionTest::new(displacement_mm, self.schedule(steps)).platens(platens))
    }

    /// Returns duration, step control and stopping criterion of a test without load program. `steps` replaces the
    /// number of load steps of the case.
    pub(crate) fn schedule(&self, steps: Option<u32>) -> Schedule {
        let steps: Arc<dyn StepController> = match steps {
            Some(steps) => Arc::new(FixedSteps(steps)),
            None => self.steps_by(),
        };
        let stop_below_peak = self.stop_below_peak;
        Schedule { steps, stop_below_peak, ..Schedule::fixed(self.duration_s(), 1) }
    }

    /// Returns the load steps of a segment whose point does not state a number of steps.
    fn segment_steps(&self, steps: Option<u32>) -> SegmentSteps {
        match (steps.or(self.steps), self.adaptive) {
            (Some(steps), _) => SegmentSteps::Fixed(steps),
            (None, Some(AdaptiveCase { first, largest })) => {
                SegmentSteps::Adaptive(AdaptiveSteps { first, largest })
            }
            (None, None) => SegmentSteps::default(),
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

/// Default duration of a test in s.
const ONE_SECOND: f64 = 1.0;

fn slip_velocity() -> f64 {
    1e-3
}
