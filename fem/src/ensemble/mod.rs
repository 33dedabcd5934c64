//! Ensembles of many tests: parallel, resumable, shared by several processes.

mod run;
mod error;
mod progress;
mod record;
mod store;

pub use run::Ensemble;
pub use error::EnsembleError;
pub use progress::EnsembleProgress;
pub use record::{RunEnd, RunInput, RunRecord, RunStatus};
