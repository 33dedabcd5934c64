//! Campaigns of many tests: parallel, resumable, shared by several processes.

mod campaign;
mod error;
mod progress;
mod record;
mod store;

pub use campaign::Campaign;
pub use error::CampaignError;
pub use progress::CampaignProgress;
pub use record::{RunEnd, RunInput, RunRecord, RunStatus};
