//! Work that is shared: with other processes in one folder, and with neighbours that made the same.

use std::sync::atomic::AtomicBool;

use super::freshness::{Freshness, Records, finished_in};
use super::stage::Stage;
use super::task::StageRecord;
use super::{Workflow, WorkflowError};
use crate::progress::say;

impl Workflow<'_> {
    /// Takes part in the work of a stage that processes share, until nothing is left that another process
    /// does not do already; what the stage writes is left to [`run`](Self::run).
    ///
    /// # Errors
    /// As [`Workflow::run`]; a stage whose work cannot be shared does nothing.
    pub fn share(&self, stage: &'static Stage) -> Result<(), WorkflowError> {
        self.check_what_it_read(stage)?;
        let finished = self.finished();
        match finished.get(stage.name) {
            Some(record) if record.change(&self.inputs(), &self.dir).is_none() => {
                say(stage.name, "finished before, unchanged");
                Ok(())
            }
            _ => {
                self.claim(stage)?;
                self.share_work(stage, &finished, true)
            }
        }
    }

    /// Checks all that the shared work of a stage needs, up to its first run; whether there is work left.
    ///
    /// # Errors
    /// As [`Workflow::share`].
    pub fn rehearse(&self, stage: &'static Stage) -> Result<bool, WorkflowError> {
        /// An ensemble that is told to end begins no run.
        static RAISED: AtomicBool = AtomicBool::new(true);
        let rehearsal = Workflow {
            file: self.file.clone(),
            dir: self.dir.clone(),
            cores: self.cores.clone(),
            copies: self.copies.clone(),
            folder: self.folder.clone(),
            freshness: Freshness::default(),
            neighbours: self.neighbours.clone(),
            interrupt: &RAISED,
            ..*self
        };
        match rehearsal.share(stage) {
            Err(WorkflowError::Interrupted) => Ok(true),
            Ok(()) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Takes part in the work of a stage, unless it leaves what others do to them.
    pub(super) fn share_work(
        &self,
        stage: &'static Stage,
        finished: &Records,
        leave_to_others: bool,
    ) -> Result<(), WorkflowError> {
        let Some(share) = stage.share else { return Ok(()) };
        self.with_task(stage, finished, |mut task| {
            task.leave_to_others = leave_to_others;
            share(&task)
        })
    }

    /// Takes the products of a neighbour whose stage read the same; what is said of it, and its record.
    pub(super) fn taken_over(
        &self,
        stage: &Stage,
        finished: &Records,
    ) -> Result<Option<(String, StageRecord)>, WorkflowError> {
        // what was accepted stands in no record
        let Some(neighbours) = self.neighbours.as_ref().filter(|_| !self.accept_out_of_range)
        else {
            return Ok(None);
        };
        let inputs = self.inputs();
        for folder in &neighbours.folders {
            let Some(record) = finished_in(folder).remove(stage.name) else { continue };
            if record.source_change(&inputs).is_some()
                || record.products().any(|name| !record.wrote(name, folder))
            {
                continue;
            }
            self.freshness.clear();
            // measured specimens lie where the stage itself would write virtual ones
            let of_others = |name: &&str| {
                inputs.writer_of(name) != Some(stage.name) && self.dir.join(name).exists()
            };
            for name in record.files_read().filter(of_others) {
                self.freshness.check(name, finished, &inputs, &self.dir)?;
            }
            for name in record.products() {
                self.folder.copy_from(&folder.join(name), name, stage.name)?;
            }
            let name = folder.strip_prefix(neighbours.root()).unwrap_or(folder).display();
            return Ok(Some((format!("as in {name}"), record)));
        }
        Ok(None)
    }
}
