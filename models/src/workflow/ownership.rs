//! Files of the user's among the products of stages: refused, used as they are, or replaced where that is allowed.

use super::pattern::folder;
use super::stage::Stage;
use super::task::StageRecord;
use super::{Workflow, WorkflowError};

impl Workflow<'_> {
    /// Refuses files of the user's in the place of the products of a stage.
    pub(super) fn claim(&self, stage: &Stage) -> Result<(), WorkflowError> {
        let case = &self.file.case;
        let may_write = |name: &str| Stage::may_write(case, name);
        self.folder.claim_all(stage.products_of(case), stage.name, may_write)
    }

    /// Why a stage has to be run again, in words; an edited product is made again where that is allowed.
    pub(super) fn change(&self, record: &StageRecord) -> Option<String> {
        let edited = record.edited(&self.dir);
        let replaced = edited.iter().find(|name| self.folder.is_replaceable(name));
        match replaced {
            Some(name) => Some(format!("--replace {name} gives up what was edited there")),
            None => record.change(&self.inputs(), &self.dir),
        }
    }

    /// Removes the program's own files that have the name of a product of the stage, but are none of its last run.
    pub(super) fn remove_leftovers(
        &self,
        stage: &Stage,
        record: &StageRecord,
    ) -> Result<(), WorkflowError> {
        let is_kept = |name: &str| {
            // what a person measured lies where virtual specimens would
            let place = folder(name);
            let is_read = !place.is_empty() && record.files_read().any(|f| f.starts_with(place));
            is_read || record.has_written(name)
        };
        self.folder.remove_leftovers(stage.products, is_kept)
    }
}
