//! Copies of files between results folders.

use std::io::ErrorKind;
use std::path::Path;

use super::error::WorkflowError;

/// Copies a file, or a folder with its contents, to a path that does not exist yet. Some file systems share the blocks
/// of the two files. Hard links are not used, because an edit of one file would also change the other file.
///
/// # Errors
/// Fails if a file cannot be read or written.
pub(crate) fn copy_tree(from: &Path, to: &Path) -> Result<(), WorkflowError> {
    let failed = |e| WorkflowError::io(to, e);
    if from.is_dir() {
        std::fs::create_dir_all(to).map_err(failed)?;
        for entry in std::fs::read_dir(from).map_err(|e| WorkflowError::io(from, e))? {
            let name = entry.map_err(|e| WorkflowError::io(from, e))?.file_name();
            copy_tree(&from.join(&name), &to.join(&name))?;
        }
        return Ok(());
    }
    std::fs::copy(from, to).map(drop).map_err(failed)
}

/// Copies a file with its modification time.
///
/// # Errors
/// Fails if the file cannot be read or written.
pub(crate) fn copy_file_with_time(from: &Path, to: &Path) -> Result<(), WorkflowError> {
    copy_tree(from, to)?;
    let time = from.metadata().and_then(|metadata| metadata.modified());
    let times = |time| std::fs::File::options().write(true).open(to)?.set_modified(time);
    time.and_then(times).map_err(|e| WorkflowError::io(to, e))
}

/// Copies every finished record of a folder of runs to another folder, unless a file of the same name exists there.
///
/// # Errors
/// The errors of [`copy_tree`].
pub(crate) fn copy_records(from: &Path, to: &Path) -> Result<(), WorkflowError> {
    let Ok(entries) = std::fs::read_dir(from) else { return Ok(()) };
    let failed = |e| WorkflowError::io(to, e);
    for entry in entries.flatten() {
        let (name, target) = (entry.file_name(), to.join(entry.file_name()));
        // names with a leading dot are locks and partial files
        let is_record = !name.to_string_lossy().starts_with('.');
        if !is_record || target.exists() {
            continue;
        }
        std::fs::create_dir_all(to).map_err(failed)?;
        let partial = tempfile::Builder::new().prefix(".").suffix(".partial").tempdir_in(to);
        let partial = partial.map_err(failed)?;
        let whole = partial.path().join(&name);
        copy_tree(&entry.path(), &whole)?;
        let moved = tempfile::TempPath::try_from_path(&whole)
            .and_then(|whole| whole.persist_noclobber(&target).map_err(|e| e.error));
        match moved {
            // another process has created the file in the meantime
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            moved => moved.map_err(failed)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copied_folder_has_the_same_content_and_is_edited_alone() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        std::fs::create_dir_all(a.join("inner")).unwrap();
        std::fs::write(a.join("inner/file"), "one").unwrap();
        copy_tree(&a, &b).unwrap();
        assert_eq!(std::fs::read_to_string(b.join("inner/file")).unwrap(), "one");
        std::fs::write(b.join("inner/file"), "edited").unwrap();
        assert_eq!(std::fs::read_to_string(a.join("inner/file")).unwrap(), "one");
    }

    #[test]
    fn records_go_where_they_are_missing_and_locks_do_not() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        for (folder, name, text) in [
            (&a, "run-1.json", "1"),
            (&a, ".run-2.lock", ""),
            (&a, "run-3.json", "3"),
            (&b, "run-3.json", "other"),
        ] {
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(folder.join(name), text).unwrap();
        }
        let read = |name: &str| std::fs::read_to_string(b.join(name)).ok();
        for _ in 0..2 {
            copy_records(&a, &b).unwrap();
            assert_eq!(read("run-1.json").as_deref(), Some("1"));
            assert_eq!(read("run-3.json").as_deref(), Some("other"));
            assert_eq!(read(".run-2.lock"), None);
            assert_eq!(std::fs::read_dir(&b).unwrap().count(), 2, "nothing half is left");
        }
        copy_records(&dir.path().join("none"), &b).unwrap();
    }
}
