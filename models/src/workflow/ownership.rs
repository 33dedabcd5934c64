//! Files of the user at the paths of products. Such a file stops the stage, is used instead of the product, or is
//! replaced if the user allows it.

use super::Workflow;
use crate::pipeline::stage::Stage;
use crate::pipeline::task::StageRecord;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::pattern::folder;

impl Workflow<'_> {
    /// Fails if a file of the user has the path of a product of the stage and may not be replaced.
    pub(super) fn claim(&self, stage: &Stage) -> Result<(), WorkflowError> {
        let case = &self.file.case;
        let may_write = |name: &str| Stage::may_write(case, name);
        self.folder.claim_all(stage.products_of(case), stage.name, may_write)
    }

    /// Returns the reason, as text, why a stage has to be run again; `None` if the stage is up to date. An edited
    /// product that may be replaced is such a reason.
    pub(super) fn change(&self, record: &StageRecord) -> Option<String> {
        let edited = record.edited(&self.dir);
        let replaced = edited.iter().find(|name| self.folder.is_replaceable(name));
        match replaced {
            Some(name) => Some(format!("--replace {name} discards the edit")),
            None => record.change(&self.inputs(), &self.dir),
        }
    }

    /// Removes files that earlier runs of the stage wrote and that the last run of the stage did
    /// not write.
    pub(super) fn remove_leftovers(
        &self,
        stage: &Stage,
        record: &StageRecord,
    ) -> Result<(), WorkflowError> {
        let is_kept = |name: &str| {
            // keep measured specimens, which are in the same folder as virtual specimens
            let folder_name = folder(name);
            let is_read =
                !folder_name.is_empty() && record.files_read().any(|f| f.starts_with(folder_name));
            is_read || record.has_written(name)
        };
        self.folder.remove_leftovers(stage.products, is_kept)
    }
}
