//! Whether what stages have written belongs to the case as it is now.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::WorkflowError;
use super::editable::is_editable;
use super::inputs::Inputs;
use super::task::StageRecord;

/// The name of the file that remembers finished stages.
pub(super) const STAGES_FILE: &str = "stages.toml";

/// What each finished stage has read and written.
pub(super) type Records = BTreeMap<String, StageRecord>;

/// The stages that have been run to their end in a folder of results.
pub(super) fn finished_in(dir: &Path) -> Records {
    fem::read_regular_text(&dir.join(STAGES_FILE))
        .ok()
        .and_then(|text| toml::from_str(&text).ok())
        .unwrap_or_default()
}

/// Files that were found to be as their stage wrote them, from inputs that are still the same.
#[derive(Debug, Default)]
pub(super) struct Freshness {
    checked: RefCell<BTreeSet<String>>,
    /// Products of each stage that the user has edited.
    edited: RefCell<BTreeMap<String, Vec<String>>>,
}

impl Freshness {
    /// Forgets what was found: a stage is being made again.
    pub(super) fn clear(&self) {
        self.checked.borrow_mut().clear();
        self.edited.borrow_mut().clear();
    }

    /// Whether the user has edited a product of this stage.
    fn is_edited(&self, stage: &str, record: &StageRecord, dir: &Path) -> bool {
        let mut edited = self.edited.borrow_mut();
        let found = || record.edited(dir).into_iter().map(str::to_owned).collect();
        !edited.entry(stage.to_owned()).or_insert_with(found).is_empty()
    }

    /// Products that were found to be edited, each by its stage.
    pub(super) fn edited(&self) -> BTreeMap<String, Vec<String>> {
        self.edited.borrow().clone()
    }

    /// Refuses a file that its stage did not write as it is, or wrote from what has changed since, up
    /// to the case. Where the user has edited a product, the files of its stage are used as they are.
    ///
    /// # Errors
    /// [`WorkflowError::Stale`].
    pub(super) fn check(
        &self,
        name: &str,
        records: &Records,
        inputs: &Inputs<'_>,
        dir: &Path,
    ) -> Result<(), WorkflowError> {
        let Some(stage) = inputs.writer_of(name) else { return Ok(()) };
        if self.checked.borrow().contains(name) {
            return Ok(());
        }
        let refuse = |change: String| {
            Err(WorkflowError::Stale { path: dir.join(name), stage: stage.to_owned(), change })
        };
        let Some(record) = records.get(stage) else {
            return refuse(format!("the stage {stage} has not been finished"));
        };
        if self.is_edited(stage, record, dir) {
            if is_editable(name) || record.wrote(name, dir) {
                self.checked.borrow_mut().insert(name.to_owned());
                return Ok(());
            }
            return refuse("it was changed".to_owned());
        }
        if let Some(change) = record.source_change(inputs) {
            return refuse(change);
        }
        // specimens that were measured lie where the stage would write virtual ones
        if record.files_read().any(|read| read == name) {
            return Ok(());
        }
        if !record.wrote(name, dir) {
            return refuse("it was changed, or is of an interrupted run".to_owned());
        }
        for file in record.files_read() {
            if dir.join(file).exists() {
                self.check(file, records, inputs, dir)?;
            }
        }
        self.checked.borrow_mut().insert(name.to_owned());
        Ok(())
    }
}
