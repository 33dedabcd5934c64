//! Boundary-value problems in time, such as the unconfined compression test: from conditions and parameters to the
//! curve and the fields.
//!
//! The modules, in the order of their layers:
//!
//! 1. `curve`: points of a curve, its file, the end of a run
//! 2. `control`: schedules, load programs and step controllers
//! 3. `interface`: bands with their own toughness around surfaces between regions
//! 4. `parameter`: material parameters of sensitivities
//! 5. `definition`: input data, discretisation, warnings
//! 6. `memory`: state of irreversible damage
//! 7. `state`: state of a run, checkpoints
//! 8. `sensitivity`: derivatives of the force from increment to increment
//! 9. `stepping`: increments, and the loop over load steps
//! 10. `evaluation`: stress, energy, forces and J-integral of fields
//! 11. `problem`: builder, problem, runs
//! 12. `compression_test`, `tension_test`: the unconfined compression test, the tension test of a round bar

mod compression_test;
mod control;
mod curve;
mod definition;
mod evaluation;
mod interface;
mod memory;
mod parameter;
#[expect(clippy::module_inception, reason = "the module is named after its main type")]
mod problem;
mod sensitivity;
mod state;
mod stepping;
mod tension_test;

pub(crate) use definition::Fingerprint;

pub use compression_test::{CompressionTest, Friction, Platens};
pub use control::{
    AdaptiveSteps, ArcLength, FixedSteps, LoadProgram, PlatenLoad, ProgramPoint, ProgramSteps,
    Progress, Schedule, SegmentSteps, Step, StepController,
};
pub use curve::{CurvePoint, CurveWriter, End, Outcome, Sensitivities, read_curve, write_curve};
pub use definition::ProblemWarning;
pub use evaluation::{CrackExtension, Evaluation};
pub use interface::Interface;
pub use parameter::MaterialParameter;
pub use problem::{Problem, ProblemBuilder};
pub use state::Checkpoint;
pub use stepping::{LoadStepper, Observer};
pub use tension_test::TensionTest;
