//! A stage that is run by itself: what it reads must be up to date.

use super::stage::Stage;
use super::stages::STAGES;
use super::status::{StageStatus, status};
use super::{Workflow, WorkflowError, report};
use crate::progress::say;

/// The file of the report.
const REPORT: &str = "report.html";

impl Workflow<'_> {
    /// Runs one stage, unless it is finished and what it read and what it wrote are unchanged. The stage
    /// `report` shows what there is where others are under way or to do, and is then run again at the end.
    ///
    /// # Errors
    /// What ended the stage; a stage before it that has not been run, or has to be run again.
    pub fn run(&self, stage: &'static Stage) -> Result<(), WorkflowError> {
        if stage.name == "report" {
            let mut stages = status(&self.dir).unwrap_or_else(|_| StageStatus::none());
            stages.retain(|before| before.stage != stage.name);
            if stages.iter().any(StageStatus::is_unfinished) {
                return self.report_so_far(&stages);
            }
            self.check_all_before(stage)?;
        }
        self.check_what_it_read(stage)?;
        self.make(stage)
    }

    /// Writes a report of what there is until now, which says what is missing. It is no product: the stage
    /// is still to be run.
    fn report_so_far(&self, stages: &[StageStatus]) -> Result<(), WorkflowError> {
        let is_done =
            |name: &str| stages.iter().any(|status| status.stage == name && status.is_done());
        let mut results = report::load_done(&self.inputs(), &is_done)?;
        let row = |status: &StageStatus| {
            let (state, told) = status.words();
            [status.stage.to_owned(), state.to_owned(), told]
        };
        results.unfinished = stages.iter().map(row).collect();
        let page = crate::report::page(&results);
        self.folder.write(REPORT, "report", page.as_bytes())?;
        let path = self.folder.path(REPORT);
        say("report", &format!("{}, of what is there until now", path.display()));
        Ok(())
    }

    /// Refuses a stage that read what is due itself.
    pub(super) fn check_what_it_read(&self, stage: &Stage) -> Result<(), WorkflowError> {
        let finished = self.finished();
        let inputs = self.inputs();
        // what it read the last time may be as it was, and yet be due itself
        for name in finished.get(stage.name).into_iter().flat_map(|record| record.files_read()) {
            if inputs.writer_of(name) != Some(stage.name) && self.dir.join(name).exists() {
                self.freshness.check(name, &finished, &inputs, &self.dir)?;
            }
        }
        Ok(())
    }

    /// A report shows what all stages left: none of those that have been run may be due.
    fn check_all_before(&self, stage: &Stage) -> Result<(), WorkflowError> {
        let records = self.finished();
        let inputs = self.inputs();
        for earlier in STAGES.iter().take_while(|earlier| earlier.name != stage.name) {
            let change = records.get(earlier.name).and_then(|r| r.change(&inputs, &self.dir));
            if let Some(change) = change {
                let path = self.dir.join(earlier.products[0]);
                return Err(WorkflowError::Stale { path, stage: earlier.name.to_owned(), change });
            }
        }
        Ok(())
    }
}
