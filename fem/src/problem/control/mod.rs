//! Load steps: the schedule, load programs, and controllers that choose the next step.

mod clock;
mod controller;
mod program;
mod program_steps;
mod schedule;
mod steps;

pub use controller::{Progress, Step, StepController};
pub use program::{LoadProgram, PlatenLoad, ProgramPoint};
pub use program_steps::{ProgramSteps, SegmentSteps};
pub use schedule::Schedule;
pub use steps::{AdaptiveSteps, ArcLength, FixedSteps};

pub(crate) use clock::is_later;
pub(crate) use schedule::check_crack_energy;
