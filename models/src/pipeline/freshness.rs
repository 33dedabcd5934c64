//! Check that the products of stages are up to date with the case.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::inputs::Inputs;
use super::task::StageRecord;
use crate::results_folder::editable::is_editable;
use crate::results_folder::error::WorkflowError;

/// Name of the file with the records of finished stages.
pub(crate) const STAGES_FILE: &str = "stages.toml";

/// Records of the finished stages by name: the inputs and the products of each stage.
pub(crate) type Records = BTreeMap<String, StageRecord>;

/// Reads the records of the finished stages of a results folder.
pub(crate) fn finished_in(dir: &Path) -> Records {
    fem::read_regular_text(&dir.join(STAGES_FILE))
        .ok()
        .and_then(|text| toml::from_str(&text).ok())
        .unwrap_or_default()
}

/// Cache of the checks: names of files that are up to date. Such a file has the content that its stage wrote, and the
/// inputs of this stage are unchanged.
#[derive(Debug, Default)]
pub(crate) struct Freshness {
    checked: RefCell<BTreeSet<String>>,
    /// Edited products of each stage.
    edited: RefCell<BTreeMap<String, Vec<String>>>,
}

impl Freshness {
    /// Clears the cache. Needed when a stage is run again.
    pub(crate) fn clear(&self) {
        self.checked.borrow_mut().clear();
        self.edited.borrow_mut().clear();
    }

    /// Whether the user has edited a product of this stage.
    fn is_edited(&self, stage: &str, record: &StageRecord, dir: &Path) -> bool {
        let mut edited = self.edited.borrow_mut();
        let edited_files = || record.edited(dir).into_iter().map(str::to_owned).collect();
        !edited.entry(stage.to_owned()).or_insert_with(edited_files).is_empty()
    }

    /// Edited products found so far, by stage.
    pub(crate) fn edited(&self) -> BTreeMap<String, Vec<String>> {
        self.edited.borrow().clone()
    }

    /// Checks that a file is up to date: a stage has written the current content of the file, and everything that the
    /// stage has read is up to date too, recursively back to the case. If the user has edited a product of a stage,
    /// changed inputs of this stage are ignored.
    ///
    /// # Errors
    /// [`WorkflowError::Stale`].
    pub(crate) fn check(
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
        // a measured specimen, which is an input at the path where the stage writes virtual
        // specimens
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
