//! Record of the files that the program has written into a folder, with the hash of their contents.
//!
//! `written.csv` has a line `content,file` for each content. The line is added before the file is renamed to its final
//! name, so that the program recognises its own files even if it was killed during the writing. Every other file
//! belongs to the user. Lines are never removed: a file belongs to the program if any line has the current content of
//! the file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::content_hash::ContentHash;
use super::error::WorkflowError;

/// Name of the record file.
pub(crate) const WRITTEN: &str = "written.csv";

/// The first line of the record.
const HEADER: &str = "content,file\n";

/// Entry instead of a hash for a file that grows while a simulation runs.
const GROWING: &str = "growing";

/// The record of one folder.
#[derive(Clone, Debug)]
pub(crate) struct Written {
    path: PathBuf,
    record: Arc<Mutex<Known>>,
}

/// The part of the record that has been read so far.
#[derive(Debug, Default)]
struct Known {
    bytes: u64,
    files: BTreeMap<String, Contents>,
}

/// All contents that the program has written to one file.
#[derive(Debug, Default)]
struct Contents {
    hashes: BTreeSet<String>,
    /// Whether the latest line of the file has the entry `growing`.
    is_growing: bool,
}

impl Written {
    /// The record of a folder; the folder need not exist yet.
    pub(crate) fn in_folder(dir: &Path) -> Self {
        Self { path: dir.join(WRITTEN), record: Arc::default() }
    }

    /// Whether the program has ever written a file of this name.
    ///
    /// # Errors
    /// Fails if the record cannot be read.
    pub(crate) fn names(&self, name: &str) -> Result<bool, WorkflowError> {
        self.with_known(|written| written.files.contains_key(name))
    }

    /// Names of all files that the program has written.
    ///
    /// # Errors
    /// The errors of [`Self::names`].
    pub(crate) fn all(&self) -> Result<Vec<String>, WorkflowError> {
        self.with_known(|written| written.files.keys().cloned().collect())
    }

    /// Whether the program has written this content to the file. Any content counts if the program was killed while the
    /// file was growing.
    ///
    /// # Errors
    /// The errors of [`Self::names`].
    pub(crate) fn has(&self, name: &str, content: ContentHash) -> Result<bool, WorkflowError> {
        self.with_known(|written| {
            let contents = written.files.get(name);
            contents.is_some_and(|c| c.is_growing || c.hashes.contains(&content.to_string()))
        })
    }

    /// Records the content of a file, before the file is written.
    ///
    /// # Errors
    /// Fails if the record cannot be written.
    pub(crate) fn add(&self, name: &str, content: ContentHash) -> Result<(), WorkflowError> {
        let is_recorded = self.with_known(|written| {
            let contents = written.files.get(name);
            let content = content.to_string();
            contents.is_some_and(|c| !c.is_growing && c.hashes.contains(&content))
        })?;
        if is_recorded { Ok(()) } else { self.append(&content.to_string(), name) }
    }

    /// Records that a file will grow from now on. [`Self::add`] records its final content.
    ///
    /// # Errors
    /// The errors of [`Self::add`].
    pub(crate) fn add_growing(&self, name: &str) -> Result<(), WorkflowError> {
        self.append(GROWING, name)
    }

    fn append(&self, content: &str, name: &str) -> Result<(), WorkflowError> {
        let failed = |e| WorkflowError::io(&self.path, e);
        let line = csv_line(content, name).map_err(failed)?;
        if let Some(folder) = self.path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        self.check_header()?;
        let mut options = OpenOptions::new();
        let mut file =
            options.read(true).append(true).create(true).open(&self.path).map_err(failed)?;
        // several processes may add lines: lock the file during a write
        let locked = file.lock();
        locked.map_err(|source| WorkflowError::Lock { path: self.path.clone(), source })?;
        let add = |file: &mut File| {
            let front = match file.metadata()?.len() {
                0 => HEADER,
                _ => {
                    let mut last = [0];
                    file.seek(SeekFrom::End(-1))?;
                    file.read_exact(&mut last)?;
                    // complete a line that a killed process has left unfinished
                    if last == [b'\n'] { "" } else { "\n" }
                }
            };
            file.write_all(&[front.as_bytes(), &line].concat())
        };
        add(&mut file).map_err(failed)
    }

    fn check_header(&self) -> Result<(), WorkflowError> {
        self.with_known(|_| ())
    }

    /// Reads the lines that were added to the record since the last call, and calls `look` with the complete record.
    fn with_known<T>(&self, look: impl FnOnce(&Known) -> T) -> Result<T, WorkflowError> {
        let mut written = self.record.lock().unwrap_or_else(PoisonError::into_inner);
        written.refresh(&self.path)?;
        Ok(look(&written))
    }
}

impl Known {
    fn refresh(&mut self, path: &Path) -> Result<(), WorkflowError> {
        let failed = |e| WorkflowError::io(path, e);
        let mut file = match fem::open_regular(path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                *self = Self::default();
                return Ok(());
            }
            Err(error) => return Err(failed(error)),
        };
        let length = file.metadata().map_err(failed)?.len();
        if length < self.bytes {
            // the file was replaced by another record
            *self = Self::default();
        }
        if length == self.bytes {
            return Ok(());
        }
        let mut text = Vec::new();
        file.seek(SeekFrom::Start(self.bytes)).map_err(failed)?;
        file.read_to_end(&mut text).map_err(failed)?;
        let lines = match self.bytes {
            0 => text.strip_prefix(HEADER.as_bytes()),
            _ => Some(&text[..]),
        };
        let Some(lines) = lines else {
            return Err(WorkflowError::NoRecord { path: path.to_owned() });
        };
        // an incomplete last line is still being written: read it at the next call
        let whole = lines.iter().rposition(|&byte| byte == b'\n').map_or(0, |end| end + 1);
        self.bytes += (text.len() - lines.len() + whole) as u64;
        self.add_lines(&lines[..whole]);
        Ok(())
    }

    /// Adds the entries of `lines`; skips an incomplete line, which a killed process has left.
    fn add_lines(&mut self, lines: &[u8]) {
        let mut reader =
            csv::ReaderBuilder::new().flexible(true).has_headers(false).from_reader(lines);
        for line in reader.records().flatten() {
            let (Some(content), Some(name), 2) = (line.get(0), line.get(1), line.len()) else {
                continue;
            };
            let contents = self.files.entry(name.to_owned()).or_default();
            contents.is_growing = content == GROWING;
            if !contents.is_growing {
                contents.hashes.insert(content.to_owned());
            }
        }
    }
}

fn csv_line(content: &str, name: &str) -> std::io::Result<Vec<u8>> {
    let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
    writer.write_record([content, name])?;
    writer.into_inner().map_err(|e| e.into_error())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_content_that_was_written_is_known_to_all_who_look() {
        let dir = tempfile::tempdir().unwrap();
        let [one, other] = [(); 2].map(|()| Written::in_folder(dir.path()));
        let [a, b] = ["a", "b"].map(ContentHash::of);
        assert!(!other.names("mesh.msh").unwrap());
        one.add("mesh.msh", a).unwrap();
        assert!(other.has("mesh.msh", a).unwrap() && !other.has("mesh.msh", b).unwrap());
        other.add("mesh.msh", b).unwrap();
        other.add("mesh.msh", b).unwrap();
        one.add("curves/a, \"b\".csv", b).unwrap();
        assert!(one.has("mesh.msh", a).unwrap() && one.has("mesh.msh", b).unwrap());
        assert!(other.has("curves/a, \"b\".csv", b).unwrap());
        assert_eq!(other.all().unwrap().len(), 2);
        let text = std::fs::read_to_string(dir.path().join(WRITTEN)).unwrap();
        assert_eq!(text.lines().count(), 4, "{text}");
    }

    #[test]
    fn a_growing_file_is_the_programs_until_its_content_is_recorded() {
        let dir = tempfile::tempdir().unwrap();
        let written = Written::in_folder(dir.path());
        let [a, b] = ["a", "b"].map(ContentHash::of);
        written.add("curve.csv", a).unwrap();
        written.add_growing("curve.csv").unwrap();
        assert!(written.has("curve.csv", b).unwrap());
        written.add("curve.csv", a).unwrap();
        assert!(written.has("curve.csv", a).unwrap() && !written.has("curve.csv", b).unwrap());
    }

    #[test]
    fn a_torn_line_costs_itself_alone_and_a_users_file_is_no_record() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(WRITTEN);
        let a = ContentHash::of("a");
        let written = Written::in_folder(dir.path());
        written.add("mesh.msh", a).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, format!("{text}{}", &a.to_string()[..9])).unwrap();
        written.add("mesh.vtu", a).unwrap();
        let again = Written::in_folder(dir.path());
        assert!(again.has("mesh.msh", a).unwrap() && again.has("mesh.vtu", a).unwrap());

        std::fs::write(&path, "id,height_mm\nS-1,4.4\n").unwrap();
        let error = Written::in_folder(dir.path()).add("mesh.msh", a).unwrap_err();
        assert!(error.to_string().contains(WRITTEN), "{error}");
        assert!(std::fs::read_to_string(&path).unwrap().starts_with("id"));
    }
}
