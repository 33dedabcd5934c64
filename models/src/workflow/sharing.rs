//! Sharing of work with other processes in the same folder, and of results with neighbouring folders.

use std::sync::atomic::AtomicBool;

use super::Workflow;
use crate::pipeline::freshness::{Freshness, Records, finished_in};
use crate::pipeline::stage::Stage;
use crate::pipeline::task::StageRecord;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;

impl Workflow<'_> {
    /// Takes part in the shared work of a stage. Returns when other processes are doing all remaining work.
    /// [`run`](Self::run) writes the products of the stage.
    ///
    /// # Errors
    /// The errors of [`Workflow::run`]. A stage whose work cannot be shared does nothing and is not an error.
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

    /// Executes the shared work of a stage up to its first run, in order to check all inputs. Returns whether work is
    /// left.
    ///
    /// # Errors
    /// The errors of [`Workflow::share`].
    pub fn rehearse(&self, stage: &'static Stage) -> Result<bool, WorkflowError> {
        /// Interrupt flag that is always set, so that an ensemble starts no run.
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
            validations: Vec::new(),
            ..*self
        };
        match rehearsal.share(stage) {
            Err(WorkflowError::Interrupted) => Ok(true),
            Ok(()) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Takes part in the shared work of a stage. If `leave_to_others`, does not wait for work that other processes are
    /// doing.
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

    /// Copies the products of the stage from a neighbouring folder in which the stage has read the same inputs. Returns
    /// a message and the record of the stage in this folder; `None` if there is no such folder.
    pub(super) fn taken_over(
        &self,
        stage: &Stage,
        finished: &Records,
    ) -> Result<Option<(String, StageRecord)>, WorkflowError> {
        // copy nothing if data out of range are accepted, because records do not contain this option
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
            // skip measured specimens: they have the paths at which the stage writes virtual specimens
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
