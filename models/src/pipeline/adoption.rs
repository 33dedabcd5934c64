//! Results folders of earlier versions of the program, which did not record the files that the
//! program wrote.

use std::path::Path;

use super::freshness::{STAGES_FILE, finished_in};
use super::task::StageRecord;
use crate::results_folder::content_hash::ContentHash;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::product_folder::ProductFolder;
use crate::results_folder::written::WRITTEN;

/// Adds the products that are listed in the records of the stages to the record of written files, if the folder has no
/// record of written files.
pub(crate) fn adopt_products(folder: &ProductFolder, dir: &Path) -> Result<(), WorkflowError> {
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
