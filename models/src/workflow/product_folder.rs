//! The one place where files of the results are written and removed.
//!
//! A file is the program's own if the record of the folder has its content ([`Written`]). Every other file is the
//! user's and is neither replaced nor removed, unless the user allows it by name. A content is recorded before
//! the file gets its name, and a file gets its name when it is whole.

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::WorkflowError;
use super::content_hash::ContentHash;
use super::folder_copies::copy_tree;
use super::pattern::{folder, matches};
use super::written::Written;

/// What a command may do in a folder that has files already.
#[derive(Clone, Debug, Default)]
pub struct FolderAccess {
    /// Whether the folder is given to this case though it has the results of another: what differs is made again.
    pub reuse: bool,
    /// Files of the user that may be replaced by products; absolute paths.
    pub replace: Vec<PathBuf>,
}

/// How long a folder may take to be replaced.
const MOMENT: Duration = Duration::from_millis(100);

/// A folder whose files the program writes.
#[derive(Clone, Debug)]
pub(crate) struct ProductFolder {
    dir: PathBuf,
    written: Written,
    /// Files of the user that may be replaced, absolute.
    replaceable: Vec<PathBuf>,
}

/// Whose a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// There is no such file.
    Nobody,
    /// The program has written this content.
    Program,
    /// Anybody else has written this content.
    User,
}

impl ProductFolder {
    /// The folder, in which these files of the user may be replaced.
    pub(crate) fn new(dir: &Path, replaceable: &[PathBuf]) -> Self {
        let written = Written::in_folder(dir);
        Self { dir: dir.to_owned(), written, replaceable: replaceable.to_vec() }
    }

    /// Another folder, in which the same files of the user may be replaced.
    pub(super) fn with_dir(&self, dir: &Path) -> Self {
        Self::new(dir, &self.replaceable)
    }

    /// Records products of a version that kept no record of files, as its stages remember them.
    ///
    /// # Errors
    /// A record that cannot be written.
    pub(super) fn adopt(&self, name: &str, content: ContentHash) -> Result<(), WorkflowError> {
        self.written.add(name, content)
    }

    /// The path of a file.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Whose the file of this name is.
    ///
    /// # Errors
    /// A record that cannot be read.
    pub(super) fn owner(&self, name: &str) -> Result<Owner, WorkflowError> {
        let path = self.path(name);
        // a link that leads nowhere is a file too
        if path.symlink_metadata().is_err() {
            return Ok(Owner::Nobody);
        }
        if !self.written.names(name)? {
            return Ok(Owner::User);
        }
        // before the record is read again: what another process writes is recorded first
        let Ok(content) = ContentHash::of_path(&path) else { return Ok(Owner::User) };
        let is_own = self.written.has(name, content)?;
        Ok(if is_own { Owner::Program } else { Owner::User })
    }

    /// Whether the program has written the file, and the user has changed it since.
    ///
    /// # Errors
    /// As [`Self::owner`].
    pub(super) fn is_edited(&self, name: &str) -> Result<bool, WorkflowError> {
        Ok(self.written.names(name)? && self.owner(name)? == Owner::User)
    }

    /// Whether the user allows that the file is replaced.
    pub(super) fn is_replaceable(&self, name: &str) -> bool {
        let path = std::path::absolute(self.path(name));
        path.is_ok_and(|path| self.replaceable.contains(&path))
    }

    /// Refuses a file of the user's in the place of one that a command is about to write.
    ///
    /// # Errors
    /// [`WorkflowError::UsersFile`].
    pub(crate) fn claim(&self, name: &str, command: &str) -> Result<(), WorkflowError> {
        if self.owner(name)? != Owner::User || self.is_replaceable(name) {
            return Ok(());
        }
        // a folder that another process is replacing has files of both contents for a moment
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

    /// Refuses files of the user's in the place of all that a command may write, before it computes anything: names
    /// that a pattern stands for and that the command may give.
    ///
    /// # Errors
    /// As [`Self::claim`].
    pub(crate) fn claim_all<'p>(
        &self,
        patterns: impl IntoIterator<Item = &'p str>,
        command: &str,
        may_write: impl Fn(&str) -> bool,
    ) -> Result<(), WorkflowError> {
        let mut names = patterns.into_iter().flat_map(|pattern| self.names_of(pattern));
        names
            .try_for_each(|name| if may_write(&name) { self.claim(&name, command) } else { Ok(()) })
    }

    /// As [`Self::claim_all`] for files that the program has never written; no file is read.
    ///
    /// # Errors
    /// As [`Self::claim`].
    pub(super) fn claim_unwritten<'p>(
        &self,
        patterns: impl IntoIterator<Item = &'p str>,
        command: &str,
        may_write: impl Fn(&str) -> bool,
    ) -> Result<(), WorkflowError> {
        let mut names = patterns.into_iter().flat_map(|pattern| self.names_of(pattern));
        names.try_for_each(|name| match may_write(&name) && !self.written.names(&name)? {
            true => self.claim(&name, command),
            false => Ok(()),
        })
    }

    /// Names of the files that are there and that the pattern stands for.
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

    /// Writes a file, unless it has this content already, and returns the fingerprint of the content.
    ///
    /// # Errors
    /// [`WorkflowError::UsersFile`]; a file that cannot be written.
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
    pub(super) fn has_content(&self, name: &str, content: ContentHash) -> bool {
        ContentHash::of_path(&self.path(name)).is_ok_and(|now| now == content)
    }

    /// Has a function write a file or a folder under another name, and moves it to its place when it is whole.
    /// Returns the fingerprint of the content.
    ///
    /// # Errors
    /// As [`Self::write`]; what the function returns.
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
        // of a run that was killed
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

    /// The path of a file that grows while a simulation runs; [`Self::end_growing`] records its content.
    ///
    /// # Errors
    /// As [`Self::write`].
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

    /// Records the content of a file that does not grow any more.
    ///
    /// # Errors
    /// A file that cannot be read, a record that cannot be written.
    pub(crate) fn end_growing(&self, name: &str) -> Result<(), WorkflowError> {
        let path = self.path(name);
        if path.symlink_metadata().is_err() {
            // a file of this name that comes later is not the program's
            return self.written.add(name, ContentHash::EMPTY);
        }
        let content = ContentHash::of_path(&path).map_err(|e| WorkflowError::io(&path, e))?;
        self.written.add(name, content)
    }

    /// Copies a file or a folder of another folder of results.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub(super) fn copy_from(
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
        // whole under another name first: at no moment is there a half file
        let partial = tempfile::Builder::new().prefix(".").suffix(".partial").tempdir_in(folder);
        let partial = partial.map_err(failed)?;
        let whole = partial.path().join("copy");
        copy_tree(from, &whole)?;
        std::fs::rename(&whole, &path).map_err(failed)
    }

    /// Whether the file has exactly these bytes.
    pub(super) fn has_bytes(&self, name: &str, content: &[u8]) -> bool {
        self.has_content(name, ContentHash::of_bytes(content))
    }

    /// Removes a file of the program's own; a file of the user's stays.
    ///
    /// # Errors
    /// A file that cannot be removed.
    pub(crate) fn remove(&self, name: &str) -> Result<(), WorkflowError> {
        if self.owner(name)? != Owner::Program {
            return Ok(());
        }
        let path = self.path(name);
        remove_tree(&path).map_err(|e| WorkflowError::io(&path, e))
    }

    /// Removes files of the program's own that some of the patterns stand for and that are not to be kept:
    /// products of another case or design.
    ///
    /// # Errors
    /// As [`Self::remove`].
    pub(super) fn remove_leftovers(
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

    /// Makes the folder of a file, and removes what a file cannot be renamed onto.
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

/// Removes a file or a whole folder; a link is removed, and what it leads to stays.
fn remove_tree(path: &Path) -> std::io::Result<()> {
    let Ok(found) = path.symlink_metadata() else { return Ok(()) };
    if found.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) }
}

/// Writes a file whole or not at all, where nothing is yet.
///
/// # Errors
/// [`std::io::ErrorKind::AlreadyExists`] for a file that is there; what the operating system says.
pub fn create_file(path: &Path, content: &[u8]) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = tempfile::Builder::new()
        .prefix(".")
        .suffix(".partial")
        .tempdir_in(folder.unwrap_or(Path::new(".")))?;
    let whole = folder.path().join("whole");
    fem::write_atomically(&whole, content)?;
    tempfile::TempPath::try_from_path(&whole)?.persist_noclobber(path).map_err(|e| e.error)
}
