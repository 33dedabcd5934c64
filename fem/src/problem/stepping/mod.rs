//! Runs: increments, the loop over load steps, observers.

mod advice;
mod carried_force;
mod increment;
mod observer;
mod stepper;

pub use observer::Observer;
pub use stepper::LoadStepper;

pub(crate) use observer::follow;
