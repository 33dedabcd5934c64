//! State of a run that is carried from step to step, and its file.

mod checkpoint;
mod past;
#[expect(clippy::module_inception, reason = "the module is named after its main type")]
mod state;

pub use checkpoint::Checkpoint;

pub(crate) use state::{Derivatives, RunState, gather_fields};
