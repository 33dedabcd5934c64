//! All writing and removing of files in results folders.
//!
//! A file belongs to the program if its content is in the record of the folder ([`Written`]). Every other file belongs
//! to the user and is neither replaced nor removed, unless the user allows it by name. A file is written under a
//! temporary name, its content is recorded, and then the file is renamed to its final name.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::content_hash::ContentHash;
use super::error::WorkflowError;
use super::folder_copies::copy_tree;
use super::pattern::{folder, matches};
use super::written::Written;

/// Existing results and files that a command may replace in a folder.
#[derive(Clone, Debug, Default)]
pub struct FolderAccess {
    /// Whether the case may use a folder with the results of another case; results with other inputs are computed
    /// again.
    pub reuse: bool,
    /// Files of the user that may be replaced by products; absolute paths.
    pub replace: Vec<PathBuf>,
}

/// Time to wait for another process to finish replacing a folder.
const MOMENT: Duration = Duration::from_millis(100);

/// A folder whose files are written by the program.
#[derive(Clone, Debug)]
pub(crate) struct ProductFolder {
    dir: PathBuf,
    written: Written,
    /// Absolute paths of the user's files that may be replaced.
    replaceable: Vec<PathBuf>,
}

/// Owner of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owner {
    /// There is no such file.
    Nobody,
    /// The current content was written by the program.
    Program,
    /// The current content was not written by the program.
    User,
}

impl ProductFolder {
    /// Creates the product folder `dir`. Files of the user at the absolute paths `replaceable` may be replaced.
    pub(crate) fn new(dir: &Path, replaceable: &[PathBuf]) -> Self {
        let written = Written::in_folder(dir);
        Self { dir: dir.to_owned(), written, replaceable: replaceable.to_vec() }
    }

    /// Returns the product folder `dir` with the same replaceable files.
    pub(crate) fn with_dir(&self, dir: &Path) -> Self {
        Self::new(dir, &self.replaceable)
    }

    /// Adds a product to the record of written files, for folders of earlier versions of the program, which did
    /// not write such a record.
    ///
    /// # Errors
    /// Fails if the record cannot be written.
    pub(crate) fn adopt(&self, name: &str, content: ContentHash) -> Result<(), WorkflowError> {
        self.written.add(name, content)
    }

    /// The path of a file.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Returns the owner of the file of this name.
    ///
    /// # Errors
    /// Fails if the record of written files cannot be read.
    pub(crate) fn owner(&self, name: &str) -> Result<Owner, WorkflowError> {
        let path = self.path(name);
        // a dangling link counts as a file too
        if path.symlink_metadata().is_err() {
            return Ok(Owner::Nobody);
        }
        if !self.written.names(name)? {
            return Ok(Owner::User);
        }
        // hash the file before reading the record again: another process adds the content to the record before it
        // writes the file
        let Ok(content) = ContentHash::of_path(&path) else { return Ok(Owner::User) };
        let is_own = self.written.has(name, content)?;
        Ok(if is_own { Owner::Program } else { Owner::User })
    }

    /// Whether the user has changed a file that the program has written.
    ///
    /// # Errors
    /// The errors of [`Self::owner`].
    pub(crate) fn is_edited(&self, name: &str) -> Result<bool, WorkflowError> {
        Ok(self.written.names(name)? && self.owner(name)? == Owner::User)
    }

    /// Whether the user allows the program to replace the file.
    pub(crate) fn is_replaceable(&self, name: &str) -> bool {
        let path = std::path::absolute(self.path(name));
        path.is_ok_and(|path| self.replaceable.contains(&path))
    }

    /// Checks that a command may write the file `name`. Fails if the path has a file of the user that may not be
    /// replaced.
    ///
    /// # Errors
    /// [`WorkflowError::UsersFile`].
    pub(crate) fn claim(&self, name: &str, command: &str) -> Result<(), WorkflowError> {
        if self.owner(name)? != Owner::User || self.is_replaceable(name) {
            return Ok(());
        }
        // while another process replaces a folder, the folder briefly contains old and new files, which no record
        // matches
        if self.path(name).is_dir() {
            std::thread::sleep(MOMENT);
            if self.owner(name)? != Owner::User {
                return Ok(());
            }
        }
        Err(WorkflowError::UsersFile {
            path: self.path(name),
            command: command.to_owned(),
            name: name.to_owned(),
            is_changed: self.written.names(name)?,
        })
    }

    /// Checks all paths that a command may write, before the command computes anything. A pattern covers the names
    /// that match the pattern and for which `may_write` is true.
    ///
    /// # Errors
    /// The errors of [`Self::claim`].
    pub(crate) fn claim_all<'p>(
        &self,
        patterns: impl IntoIterator<Item = &'p str>,
        command: &str,
        may_write: impl Fn(&str) -> bool,
    ) -> Result<(), WorkflowError> {
        self.claim_some(patterns, command, |name| Ok(may_write(name)))
    }

    /// Does the checks of [`Self::claim_all`] only for files that the program has never written; no content of a file
    /// is read.
    ///
    /// # Errors
    /// The errors of [`Self::claim`].
    pub(crate) fn claim_unwritten<'p>(
        &self,
        patterns: impl IntoIterator<Item = &'p str>,
        command: &str,
        may_write: impl Fn(&str) -> bool,
    ) -> Result<(), WorkflowError> {
        self.claim_some(patterns, command, |name| Ok(may_write(name) && !self.written.names(name)?))
    }

    /// Checks the existing files that match a pattern and that meet a condition.
    fn claim_some<'p>(
        &self,
        patterns: impl IntoIterator<Item = &'p str>,
        command: &str,
        is_meant: impl Fn(&str) -> Result<bool, WorkflowError>,
    ) -> Result<(), WorkflowError> {
        let mut names = patterns.into_iter().flat_map(|pattern| self.names_of(pattern));
        names.try_for_each(|name| match is_meant(&name)? {
            true => self.claim(&name, command),
            false => Ok(()),
        })
    }

    /// Names of the existing files that match a pattern.
    fn names_of(&self, pattern: &str) -> Vec<String> {
        if !pattern.contains(['#', '*']) {
            let is_there = self.path(pattern).symlink_metadata().is_ok();
            return is_there.then(|| pattern.to_owned()).into_iter().collect();
        }
        let folder = folder(pattern);
        let entries = std::fs::read_dir(self.path(folder)).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let names = names.map(|name| match folder.is_empty() {
            true => name,
            false => format!("{folder}/{name}"),
        });
        let mut names: Vec<String> = names.filter(|name| matches(pattern, name)).collect();
        names.sort();
        names
    }

    /// Writes a file, unless the file already has this content. Returns the hash of the content.
    ///
    /// # Errors
    /// [`WorkflowError::UsersFile`], or the file cannot be written.
    pub(crate) fn write(
        &self,
        name: &str,
        command: &str,
        content: &[u8],
    ) -> Result<ContentHash, WorkflowError> {
        let path = self.path(name);
        let hash = ContentHash::of_bytes(content);
        if self.has_content(name, hash) {
            return self.written.add(name, hash).map(|()| hash);
        }
        self.claim(name, command)?;
        self.make_way(name)?;
        self.written.add(name, hash)?;
        fem::write_atomically(&path, content).map_err(|e| WorkflowError::io(&path, e))?;
        Ok(hash)
    }

    /// Whether the file has this content.
    pub(crate) fn has_content(&self, name: &str, content: ContentHash) -> bool {
        ContentHash::of_path(&self.path(name)).is_ok_and(|now| now == content)
    }

    /// Calls `write` to create a file or folder at a temporary path, and renames it to `name` when it is complete.
    /// Returns the hash of the content.
    ///
    /// # Errors
    /// The errors of [`Self::write`] and of the function `write`.
    pub(crate) fn write_with<E>(
        &self,
        name: &str,
        command: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<ContentHash, WorkflowError>
    where
        WorkflowError: From<E>,
    {
        self.claim(name, command)?;
        let path = self.path(name);
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let partial = path.with_file_name(format!(".{file}.partial"));
        let failed = |e| WorkflowError::io(&path, e);
        // remove the temporary folder of a killed run
        remove_tree(&partial).map_err(failed)?;
        std::fs::create_dir_all(&partial).map_err(failed)?;
        let whole = partial.join(&file);
        let moved = write(&whole).map_err(WorkflowError::from).and_then(|()| {
            let hash = ContentHash::of_path(&whole).map_err(failed)?;
            self.written.add(name, hash)?;
            self.make_way(name)?;
            std::fs::rename(&whole, &path).map_err(failed).map(|()| hash)
        });
        let removed = remove_tree(&partial).map_err(failed);
        moved.and_then(|hash| removed.map(|()| hash))
    }

    /// Returns the path for a file that grows while a simulation runs. Call [`Self::end_growing`] at the end to record
    /// its content.
    ///
    /// # Errors
    /// The errors of [`Self::write`].
    pub(crate) fn begin_growing(
        &self,
        name: &str,
        command: &str,
    ) -> Result<PathBuf, WorkflowError> {
        self.claim(name, command)?;
        let path = self.path(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| WorkflowError::io(folder, e))?;
        }
        self.written.add_growing(name)?;
        Ok(path)
    }

    /// Records the content of a file that has stopped growing.
    ///
    /// # Errors
    /// Fails if the file cannot be read or the record cannot be written.
    pub(crate) fn end_growing(&self, name: &str) -> Result<(), WorkflowError> {
        let path = self.path(name);
        if path.symlink_metadata().is_err() {
            // an empty content is recorded, so that a later file of this name belongs to the user
            return self.written.add(name, ContentHash::EMPTY);
        }
        let content = ContentHash::of_path(&path).map_err(|e| WorkflowError::io(&path, e))?;
        self.written.add(name, content)
    }

    /// Copies a file or a folder from another results folder.
    ///
    /// # Errors
    /// The errors of [`Self::write`].
    pub(crate) fn copy_from(
        &self,
        from: &Path,
        name: &str,
        command: &str,
    ) -> Result<(), WorkflowError> {
        let path = self.path(name);
        let failed = |e| WorkflowError::io(&path, e);
        let content = ContentHash::of_path(from).map_err(|e| WorkflowError::io(from, e))?;
        if self.has_content(name, content) {
            return self.written.add(name, content);
        }
        self.claim(name, command)?;
        self.make_way(name)?;
        self.written.add(name, content)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        // copy to a temporary path, then rename: a partial file never has the final name
        let partial = tempfile::Builder::new().prefix(".").suffix(".partial").tempdir_in(folder);
        let partial = partial.map_err(failed)?;
        let whole = partial.path().join("copy");
        copy_tree(from, &whole)?;
        std::fs::rename(&whole, &path).map_err(failed)
    }

    /// Whether the content of the file equals the given bytes.
    pub(crate) fn has_bytes(&self, name: &str, content: &[u8]) -> bool {
        self.has_content(name, ContentHash::of_bytes(content))
    }

    /// Removes a file if it belongs to the program; a file of the user is kept.
    ///
    /// # Errors
    /// Fails if the file cannot be removed.
    pub(crate) fn remove(&self, name: &str) -> Result<(), WorkflowError> {
        if self.owner(name)? != Owner::Program {
            return Ok(());
        }
        let path = self.path(name);
        remove_tree(&path).map_err(|e| WorkflowError::io(&path, e))
    }

    /// Removes the files of the program that match one of `patterns` and for which `is_kept` is false. Such files are
    /// products of an earlier case or design.
    ///
    /// # Errors
    /// The errors of [`Self::remove`].
    pub(crate) fn remove_leftovers(
        &self,
        patterns: &[&str],
        is_kept: impl Fn(&str) -> bool,
    ) -> Result<(), WorkflowError> {
        let is_meant = |name: &String| patterns.iter().any(|pattern| matches(pattern, name));
        let all = self.written.all()?;
        all.iter()
            .filter(|name| is_meant(name) && !is_kept(name))
            .try_for_each(|name| self.remove(name))
    }

    /// Creates the parent folder of a file. Removes a folder at the path of the file, because a file cannot be renamed
    /// to the path of a folder.
    fn make_way(&self, name: &str) -> Result<(), WorkflowError> {
        let path = self.path(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| WorkflowError::io(folder, e))?;
        }
        if path.is_dir() {
            return remove_tree(&path).map_err(|e| WorkflowError::io(&path, e));
        }
        Ok(())
    }
}

/// Removes a file or a whole folder. A link is removed, but not its target.
fn remove_tree(path: &Path) -> std::io::Result<()> {
    let Ok(metadata) = path.symlink_metadata() else { return Ok(()) };
    if metadata.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) }
}

/// Creates a file, either completely or not at all; never replaces a file.
///
/// # Errors
/// [`std::io::ErrorKind::AlreadyExists`] if the file exists; other errors of the operating system.
pub(crate) fn create_file(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = tempfile::Builder::new()
        .prefix(".")
        .suffix(".partial")
        .tempdir_in(folder.unwrap_or(Path::new(".")))?;
    let whole = folder.path().join("whole");
    fem::write_atomically(&whole, content)?;
    tempfile::TempPath::try_from_path(&whole)?.persist_noclobber(path).map_err(|e| e.error)
}
