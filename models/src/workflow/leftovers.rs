//! What must go: products of another case or design, and damaged ones.

use std::path::Path;

use super::WorkflowError;
use super::stage::Stage;
use super::task::StageRecord;

/// Removes what has the name of a product of the stage, but is none of its last run.
///
/// # Errors
/// A file that cannot be removed.
pub(super) fn remove_leftovers(
    stage: &Stage,
    record: &StageRecord,
    dir: &Path,
) -> Result<(), WorkflowError> {
    for product in stage.products {
        let (folder, pattern) = product.rsplit_once('/').unwrap_or(("", product));
        // what a person measured lies where virtual specimens would
        if !folder.is_empty() && record.files_read().any(|file| file.starts_with(folder)) {
            continue;
        }
        let Ok(entries) = std::fs::read_dir(dir.join(folder)) else { continue };
        for entry in entries.flatten() {
            let Ok(name) = entry.file_name().into_string() else { continue };
            let is_meant = match pattern.strip_suffix('*') {
                Some(start) => name.starts_with(start),
                None => name == pattern,
            };
            let place = if folder.is_empty() { name } else { format!("{folder}/{name}") };
            if is_meant && !record.has_written(&place) {
                remove(&entry.path())?;
            }
        }
    }
    Ok(())
}

/// Removes products that are not as the last run wrote them: what is half there must not stand in the
/// way of what is made again.
///
/// # Errors
/// A file that cannot be removed.
pub(super) fn remove_damaged(record: &StageRecord, dir: &Path) -> Result<(), WorkflowError> {
    let damaged = record.products().filter(|name| !record.wrote(name, dir));
    damaged
        .map(|name| dir.join(name))
        .filter(|path| path.exists())
        .try_for_each(|path| remove(&path))
}

/// Removes a file or a whole folder.
fn remove(path: &Path) -> Result<(), WorkflowError> {
    let removed = match path.is_dir() {
        true => std::fs::remove_dir_all(path),
        false => std::fs::remove_file(path),
    };
    removed.map_err(|e| WorkflowError::io(path, e))
}
