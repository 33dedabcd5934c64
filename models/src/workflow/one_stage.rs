//! Running a single stage: all files that the stage reads must be up to date.

use super::Workflow;
use super::status::{StageStatus, status};
use crate::pipeline::stage::Stage;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::stages::report;
use crate::stages::table::STAGES;

/// File name of the report.
const REPORT: &str = "report.html";

impl Workflow<'_> {
    /// Runs one stage, unless it is finished and nothing that it has read or written has changed. The stage `report`
    /// can be run while other stages are unfinished: the report then shows the existing results, and the stage has to
    /// be run again at the end.
    ///
    /// # Errors
    /// The error that ended the stage; an error if an earlier stage has not been run or has to be run again.
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

    /// Writes a report of the existing results and the unfinished stages. This report does not count as a product of
    /// the stage `report`, so that the stage remains unfinished.
    fn report_so_far(&self, stages: &[StageStatus]) -> Result<(), WorkflowError> {
        let is_done =
            |name: &str| stages.iter().any(|status| status.stage == name && status.is_done());
        let mut results = report::load_done(&self.inputs(), &is_done)
            .map_err(|error| self.copies.named_by_owner(error))?;
        let row = |status: &StageStatus| {
            let (state, progress) = status.words();
            [status.stage.to_owned(), state.to_owned(), progress]
        };
        results.unfinished = stages.iter().map(row).collect();
        let page = crate::report::page(&results);
        self.folder.write(REPORT, "report", page.as_bytes())?;
        let path = self.folder.path(REPORT);
        say("report", &format!("{}, with the results that exist", path.display()));
        Ok(())
    }

    /// Checks that the files that the last run of the stage has read are up to date.
    pub(super) fn check_what_it_read(&self, stage: &Stage) -> Result<(), WorkflowError> {
        let finished = self.finished();
        let inputs = self.inputs();
        // comparing contents is not enough: a file may be unchanged although the stage that wrote it has to be run
        // again
        for name in finished.get(stage.name).into_iter().flat_map(|record| record.files_read()) {
            if inputs.writer_of(name) != Some(stage.name) && self.dir.join(name).exists() {
                self.freshness.check(name, &finished, &inputs, &self.dir)?;
            }
        }
        Ok(())
    }

    /// Checks that the stages `names` are finished and up to date.
    pub(super) fn check_stages(&self, names: &[&str]) -> Result<(), WorkflowError> {
        let (records, inputs) = (self.finished(), self.inputs());
        for stage in STAGES.iter().filter(|stage| names.contains(&stage.name)) {
            let Some(record) = records.get(stage.name) else {
                let path = self.dir.join(stage.products[0]);
                return Err(WorkflowError::Missing { path, stage: stage.name });
            };
            if let Some(change) = record.change(&inputs, &self.dir) {
                let path = self.dir.join(stage.products[0]);
                return Err(WorkflowError::Stale { path, stage: stage.name.to_owned(), change });
            }
        }
        Ok(())
    }

    /// Checks that all finished stages before `stage` are up to date. The report needs this check because it shows the
    /// results of all stages.
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
