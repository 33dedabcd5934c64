//! Ensembles of many runs: parallel, resumable, and shared by several processes.

mod error;
mod look;
mod progress;
mod record;
mod record_file;
mod run;
mod store;

pub use error::EnsembleError;
pub use look::EnsembleState;
pub use progress::EnsembleProgress;
pub use record::{RunEnd, RunInput, RunRecord, RunStatus};
pub use run::Ensemble;
