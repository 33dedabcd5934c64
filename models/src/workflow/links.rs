//! One content in several folders of results.

use std::path::Path;

use super::WorkflowError;
use super::content_hash::ContentHash;

/// Gives a file, or all of a folder, a place in another folder too, in place of what is there. Where the
/// file system can, it is the same file under another name, else a copy.
///
/// # Errors
/// A file that cannot be read or written.
pub(super) fn link(from: &Path, to: &Path) -> Result<(), WorkflowError> {
    let failed = |e| WorkflowError::io(to, e);
    if from.is_dir() {
        if to.is_dir() {
            std::fs::remove_dir_all(to).map_err(failed)?;
        }
        std::fs::create_dir_all(to).map_err(failed)?;
        for entry in std::fs::read_dir(from).map_err(|e| WorkflowError::io(from, e))? {
            let name = entry.map_err(|e| WorkflowError::io(from, e))?.file_name();
            link(&from.join(&name), &to.join(&name))?;
        }
        return Ok(());
    }
    let folder = to.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(failed)?;
    // whole under another name first: at no moment is there a half file
    let partial = tempfile::Builder::new().prefix(".").suffix(".partial").make_in(folder, |path| {
        // who overwrites one of two names in place changes both, which can be prevented where it is seen
        if cfg!(unix) && std::fs::hard_link(from, path).is_ok() {
            return Ok(());
        }
        std::fs::copy(from, path).map(drop)
    });
    let partial = partial.map_err(failed)?.into_temp_path();
    // a rename onto another name of the same file leaves both names
    if same_content(from, to) {
        return Ok(());
    }
    partial.persist(to).map_err(|e| failed(e.error))
}

fn same_content(a: &Path, b: &Path) -> bool {
    let length = |path: &Path| std::fs::metadata(path).ok().map(|file| file.len());
    length(a) == length(b)
        && matches!((ContentHash::of_path(a), ContentHash::of_path(b)), (Ok(a), Ok(b)) if a == b)
}

/// Puts every finished file of a folder of runs into another one, where it is missing or other.
///
/// # Errors
/// As [`link`].
pub(super) fn link_records(from: &Path, to: &Path, replace: bool) -> Result<(), WorkflowError> {
    let Ok(entries) = std::fs::read_dir(from) else { return Ok(()) };
    for entry in entries.flatten() {
        let (name, place) = (entry.file_name(), to.join(entry.file_name()));
        // locks and half files
        let is_record = !name.to_string_lossy().starts_with('.');
        if is_record && (replace || !place.exists()) {
            link(&entry.path(), &place)?;
        }
    }
    Ok(())
}

/// Makes way for a file that is written in place: one that has other names too keeps its content under
/// those.
///
/// # Errors
/// A file that cannot be removed.
pub(super) fn part_from_other_names(path: &Path) -> Result<(), WorkflowError> {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).map_err(|e| WorkflowError::io(path, e))?;
        return entries.flatten().try_for_each(|entry| part_from_other_names(&entry.path()));
    }
    if has_other_names(path) {
        std::fs::remove_file(path).map_err(|e| WorkflowError::io(path, e))?;
    }
    Ok(())
}

#[cfg(unix)]
fn has_other_names(path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt as _;
    std::fs::symlink_metadata(path).is_ok_and(|file| file.nlink() > 1)
}

#[cfg(not(unix))]
fn has_other_names(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linked_folder_is_the_same_until_one_of_the_two_is_written() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        std::fs::create_dir_all(a.join("inner")).unwrap();
        std::fs::write(a.join("inner/file"), "one").unwrap();
        std::fs::create_dir_all(b.join("old")).unwrap();
        for _ in 0..2 {
            link(&a, &b).unwrap();
            assert_eq!(std::fs::read_to_string(b.join("inner/file")).unwrap(), "one");
            assert!(!b.join("old").exists());
        }
        part_from_other_names(&b).unwrap();
        std::fs::write(b.join("inner/file"), "two").unwrap();
        assert_eq!(std::fs::read_to_string(a.join("inner/file")).unwrap(), "one");
        let left = std::fs::read_dir(b.join("inner")).unwrap().count();
        assert_eq!(left, 1, "nothing half is left");
    }

    #[test]
    fn records_go_where_they_are_missing_and_locks_do_not() {
        let dir = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        for (folder, name, text) in [
            (&a, "run-1.json", "1"),
            (&a, ".run-2.lock", ""),
            (&a, "run-3.json", "3"),
            (&b, "run-3.json", "damaged"),
        ] {
            std::fs::create_dir_all(folder).unwrap();
            std::fs::write(folder.join(name), text).unwrap();
        }
        let read = |name: &str| std::fs::read_to_string(b.join(name)).ok();
        link_records(&a, &b, false).unwrap();
        assert_eq!(read("run-1.json").as_deref(), Some("1"));
        assert_eq!(read("run-3.json").as_deref(), Some("damaged"));
        assert_eq!(read(".run-2.lock"), None);
        link_records(&a, &b, true).unwrap();
        assert_eq!(read("run-3.json").as_deref(), Some("3"));
        link_records(&dir.path().join("none"), &b, true).unwrap();
    }
}
