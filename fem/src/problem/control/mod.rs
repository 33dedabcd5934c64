//! Load steps: the schedule, and controllers that choose the next step.

mod controller;
mod schedule;
mod steps;

pub use controller::{Progress, Step, StepController};
pub use schedule::Schedule;
pub use steps::{AdaptiveSteps, ArcLength, FixedSteps};

pub(crate) use schedule::check_crack_energy;
