//! Files of the user's among the products of stages: refused, used as they are, or replaced where that is allowed.

use std::path::Path;

use super::content_hash::ContentHash;
use super::freshness::{STAGES_FILE, finished_in};
use super::pattern::folder;
use super::product_folder::ProductFolder;
use super::stage::Stage;
use super::task::StageRecord;
use super::written::WRITTEN;
use super::{Workflow, WorkflowError};

impl Workflow<'_> {
    /// Refuses files of the user's in the place of the products of a stage.
    pub(super) fn claim(&self, stage: &Stage) -> Result<(), WorkflowError> {
        self.folder.claim_all(stage.products_of(&self.file.case), stage.name)
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

/// What is said of a stage that is not run again.
pub(super) fn finished_before(edited: &[&str]) -> String {
    match edited {
        [] => "finished before, unchanged".to_owned(),
        edited => format!(
            "finished before; {} was edited and is used as it is (--replace {} makes it again)",
            edited.join(", "),
            edited[0]
        ),
    }
}

/// Records the products of a version that kept no record of files, as its stages remember them.
pub(super) fn adopt_products(folder: &ProductFolder, dir: &Path) -> Result<(), WorkflowError> {
    if dir.join(WRITTEN).exists() {
        return Ok(());
    }
    let finished = finished_in(dir);
    if finished.is_empty() {
        return Ok(());
    }
    for (name, content) in finished.values().flat_map(StageRecord::contents) {
        folder.adopt(name, content)?;
    }
    let path = dir.join(STAGES_FILE);
    let content = ContentHash::of_path(&path).map_err(|e| WorkflowError::io(&path, e))?;
    folder.adopt(STAGES_FILE, content)
}
