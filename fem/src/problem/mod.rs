//! Boundary-value problems in time: from conditions and parameters to the curve and the fields. The unconfined
//! compression test is one of them.

mod advice;
mod builder;
mod checkpoint;
mod compression_test;
mod controller;
mod curve;
mod curve_file;
mod definition;
mod discretisation;
mod fingerprint;
mod increment;
mod memory;
mod parameter;
mod past;
#[expect(clippy::module_inception, reason = "the room is named after what it is for")]
mod problem;
mod rounding;
mod run;
mod schedule;
mod sensitivity;
mod state;
mod stepper;
mod steps;
mod warning;

pub(crate) use fingerprint::Fingerprint;

pub use builder::ProblemBuilder;
pub use checkpoint::Checkpoint;
pub use compression_test::{CompressionTest, Friction, Platens};
pub use controller::{Progress, Step, StepController};
pub use curve::{CurvePoint, End, Outcome, Sensitivities};
pub use curve_file::{CurveWriter, read_curve, write_curve};
pub use parameter::MaterialParameter;
pub use problem::Problem;
pub use run::Observer;
pub use schedule::Schedule;
pub use stepper::LoadStepper;
pub use steps::{AdaptiveSteps, ArcLength, FixedSteps};
pub use warning::ProblemWarning;
