//! Results folders of earlier versions of the program, which did not record the files that the
//! program wrote.

use std::path::Path;

use super::WorkflowError;
use super::content_hash::ContentHash;
use super::freshness::{STAGES_FILE, finished_in};
use super::product_folder::ProductFolder;
use super::task::StageRecord;
use super::written::WRITTEN;

/// Adds the products that are listed in the records of the stages to the record of written files, if the folder has no
/// record of written files.
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
