//! Stages and report sections that a program of the user adds.

use std::fmt;
use std::sync::OnceLock;

use super::stage::Stage;
use super::task::Task;
use crate::results_folder::error::WorkflowError;

static STAGES: OnceLock<Vec<Stage>> = OnceLock::new();
static SECTIONS: OnceLock<Vec<ReportSection>> = OnceLock::new();

/// Makes these stages and sections those of the process. Returns `false` if they were read or set before.
pub(crate) fn install(stages: Vec<Stage>, sections: Vec<ReportSection>) -> bool {
    let is_first = STAGES.set(stages).is_ok();
    SECTIONS.set(sections).is_ok() && is_first
}

/// The stages of the user's program, in order.
pub(crate) fn further_stages() -> &'static [Stage] {
    STAGES.get_or_init(Vec::new)
}

/// The report sections of the user's program, in order.
pub(crate) fn further_sections() -> &'static [ReportSection] {
    SECTIONS.get_or_init(Vec::new)
}

/// A section of the report that a program of the user adds.
#[derive(Clone, Copy)]
pub struct ReportSection {
    pub(crate) title: &'static str,
    pub(crate) content: fn(&Task<'_>) -> Result<Option<String>, WorkflowError>,
}

impl ReportSection {
    /// Section with a title. `content` returns the HTML below the title, or `None` for a case without this section. The
    /// function reads results through the [`Task`], so that the report is written again after a change of the results.
    pub fn new(
        title: &'static str,
        content: fn(&Task<'_>) -> Result<Option<String>, WorkflowError>,
    ) -> Self {
        Self { title, content }
    }
}

impl fmt::Debug for ReportSection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReportSection").field("title", &self.title).finish_non_exhaustive()
    }
}
