//! What a stage of the workflow is.

use super::WorkflowError;
use super::task::Task;

/// Work that several processes do together.
pub(super) type Share = fn(&Task<'_>) -> Result<(), WorkflowError>;

/// A step of the workflow; [`STAGES`](super::STAGES) has them in order.
///
/// What a stage reads is not listed: it is found out when the stage runs.
#[derive(Debug)]
pub struct Stage {
    /// Its subcommand.
    pub name: &'static str,
    /// What it does, in a line.
    pub about: &'static str,
    /// The files that it writes: `#` stands for a number, `*` for any text without a slash.
    pub products: &'static [&'static str],
    /// Work that several processes can do together, before one of them runs the rest.
    pub(super) share: Option<Share>,
    pub(super) run: fn(&Task<'_>) -> Result<String, WorkflowError>,
}

impl Stage {
    /// Whether it makes the specimen, which cases of one study may have in common.
    pub(super) fn is_of_the_specimen(&self) -> bool {
        matches!(self.name, "segment" | "mesh")
    }

    /// Whether several processes can do its work together.
    pub fn is_shared(&self) -> bool {
        self.share.is_some()
    }
}
