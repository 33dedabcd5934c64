//! Sharing of work: with other processes in the same folder, and with neighbouring folders that have the same results.

use std::sync::atomic::AtomicBool;

use super::freshness::{Freshness, Records, finished_in};
use super::stage::Stage;
use super::task::StageRecord;
use super::{Workflow, WorkflowError};
use crate::progress::say;

impl Workflow<'_> {
    /// Takes part in the shared work of a stage, until all work that is left is being done by other processes. The
    /// products of the stage are written by [`run`](Self::run).
    ///
    /// # Errors
    /// As [`Workflow::run`]. For a stage whose work cannot be shared, nothing is done.
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

    /// Checks all inputs of the shared work of a stage up to its first run. Returns whether work is left.
    ///
    /// # Errors
    /// As [`Workflow::share`].
    pub fn rehearse(&self, stage: &'static Stage) -> Result<bool, WorkflowError> {
        /// A raised interrupt flag: an ensemble that sees it starts no run.
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

    /// Takes part in the shared work of a stage. With `leave_to_others`, does not wait for work that other processes
    /// are doing.
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

    /// Copies the products of a neighbouring folder whose stage has read the same inputs. Returns a message and the
    /// record of that stage; none if there is no such folder.
    pub(super) fn taken_over(
        &self,
        stage: &Stage,
        finished: &Records,
    ) -> Result<Option<(String, StageRecord)>, WorkflowError> {
        // records do not contain whether data out of range were accepted
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
            // skip files that the stage itself writes in the virtual case: measured specimens have the same paths
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
