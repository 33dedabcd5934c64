//! Recorded access to the inputs of a stage. A stage reads every part of the case and every file through this module,
//! which records the hash of the content. The record therefore lists everything that the stage depends on. The trait
//! [`CaseInputs`](crate::case_inputs::CaseInputs) has a method for each part of the case.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use crate::case::{Case, CaseFile};
use crate::results_folder::error::WorkflowError;
use crate::results_folder::sources::{Origin, Sources};

/// Check that returns an error for a file that the stage must not use, given the name of the file.
type Guard<'a> = &'a dyn Fn(&str) -> Result<(), WorkflowError>;

/// Access of a stage to the case and the results folder; records everything that is read.
pub(crate) struct Inputs<'a> {
    file: &'a CaseFile,
    dir: &'a Path,
    origin: Origin<'a>,
    /// Returns the stage that writes the file of a given name, if there is one.
    writer: fn(&str) -> Option<&'static str>,
    /// Rejects result files that are out of date.
    guard: Option<Guard<'a>>,
    /// Smallest number of specimens: two for a calibration, which estimates the scatter between specimens.
    least_specimens: usize,
    /// Record of everything read so far. The record is a `RefCell`, which threads cannot share. Simulations that run
    /// on other threads therefore cannot read inputs.
    read: RefCell<Sources>,
}

impl<'a> Inputs<'a> {
    /// Creates the inputs of a stage from a case, the results folder, and a function that returns the stage that writes
    /// a given file.
    pub(crate) fn new(
        file: &'a CaseFile,
        dir: &'a Path,
        writer: fn(&str) -> Option<&'static str>,
    ) -> Self {
        let origin = Origin::of(&file.case, dir);
        let read = RefCell::default();
        Self { file, dir, origin, writer, guard: None, least_specimens: 2, read }
    }

    /// Creates the inputs of another case with the same results folder and an empty record.
    pub(crate) fn of<'b>(&self, file: &'b CaseFile) -> Inputs<'b>
    where
        'a: 'b,
    {
        Inputs::new(file, self.dir, self.writer)
    }

    /// Creates the inputs of another case in another results folder with an empty record.
    pub(crate) fn of_folder<'b>(&self, file: &'b CaseFile, dir: &'b Path) -> Inputs<'b> {
        Inputs::new(file, dir, self.writer)
    }

    /// Adds a guard: the stage gets a file only if the guard accepts the file.
    pub(crate) fn guarded(self, guard: Guard<'a>) -> Self {
        Self { guard: Some(guard), ..self }
    }

    /// Returns these inputs for held-out specimens, which the calibration does not use: a single specimen is
    /// sufficient.
    pub(crate) fn of_held_out(self) -> Self {
        Self { least_specimens: 1, ..self }
    }

    /// Smallest number of specimens.
    pub(crate) fn least_specimens(&self) -> usize {
        self.least_specimens
    }

    /// Parts of the case and files that have been read so far.
    pub(crate) fn sources(&self) -> Sources {
        self.read.borrow().clone()
    }

    /// Records keys of the case and files, and returns their fingerprints, one line `name = fingerprint` each.
    pub(crate) fn fingerprints(&self, keys: &[&str], files: &[&str]) -> String {
        keys.iter().for_each(|key| self.reads(key));
        files.iter().for_each(|name| drop(self.reads_file(name)));
        self.read.borrow().lines(keys, files)
    }

    /// Describes the first changed entry of `sources`, if there is one.
    pub(crate) fn change(&self, sources: &Sources) -> Option<String> {
        sources.change(&self.origin)
    }

    /// Hash of the table `[specimen]`. Cases with different specimens have different hashes.
    pub(crate) fn specimen(&self) -> String {
        self.origin.part("specimen")
    }

    /// The case, without recording. The caller records every key that it reads.
    pub(crate) fn unrecorded(&self) -> &'a CaseFile {
        self.file
    }

    /// Records a key of the case.
    pub(crate) fn reads(&self, key: &str) {
        self.read.borrow_mut().read_part(&self.origin, key);
    }

    /// Records all files of an image: a header file refers to a separate file of values.
    pub(crate) fn reads_image(&self, path: &Path) {
        for file in fem::image_files(&self.dir.join(path)) {
            let name = if path.is_absolute() { None } else { file.strip_prefix(self.dir).ok() };
            self.reads_file(&name.unwrap_or(&file).to_string_lossy());
        }
    }

    /// Records a file, and returns its path.
    pub(crate) fn reads_file(&self, name: &str) -> PathBuf {
        self.read.borrow_mut().read_file(&self.origin, name);
        self.dir.join(name)
    }
}

impl Inputs<'_> {
    /// The whole case. A stage that calls this method depends on every key.
    pub(crate) fn case(&self) -> &Case {
        self.reads("");
        &self.file.case
    }

    /// Records all keys and files that `other` has read.
    pub(crate) fn reads_with(&self, other: &Inputs<'_>) {
        let sources = other.sources();
        sources.case_keys().for_each(|key| self.reads(key));
        sources.files().for_each(|name| drop(self.reads_file(name)));
    }

    /// Path of a file that the case names; records its content.
    pub(crate) fn named_file(&self, path: &Path) -> PathBuf {
        self.reads_file(&path.to_string_lossy())
    }

    /// Records everything that `inner`, the inputs of a case in the subfolder `folder`, has read: its keys as keys of
    /// this case, and its files as files in `folder`. Also records the key `tests`.
    pub(crate) fn reads_in_folder(&self, inner: &Inputs<'_>, folder: &str) {
        let sources = inner.sources();
        sources.case_keys().for_each(|key| self.reads(key));
        self.reads("tests");
        sources.files().for_each(|name| drop(self.reads_file(&format!("{folder}/{name}"))));
    }

    /// The directory of the results.
    pub(crate) fn folder(&self) -> &Path {
        self.dir
    }

    /// Path of the case file, for messages.
    pub(crate) fn case_path(&self) -> &Path {
        &self.file.path
    }

    /// The name of the stage that writes a file of the results.
    pub(crate) fn writer_of(&self, name: &str) -> Option<&'static str> {
        (self.writer)(name)
    }

    /// Path of a file that an earlier stage has written.
    pub(crate) fn file(&self, name: &str) -> Result<PathBuf, WorkflowError> {
        let path = self.reads_file(name);
        match self.writer_of(name) {
            Some(stage) if !path.is_file() => Err(WorkflowError::Missing { path, stage }),
            _ => self.guard.map_or(Ok(()), |guard| guard(name)).map(|()| path),
        }
    }

    /// Text of a file that an earlier stage has written.
    pub(crate) fn text(&self, name: &str) -> Result<String, WorkflowError> {
        let path = self.file(name)?;
        fem::read_regular_text(&path).map_err(|e| WorkflowError::io(&path, e))
    }

    /// Content of a JSON file that an earlier stage has written.
    pub(crate) fn json<T: serde::de::DeserializeOwned>(
        &self,
        name: &str,
    ) -> Result<T, WorkflowError> {
        let text = self.text(name)?;
        let stage = self.writer_of(name).unwrap_or("run");
        serde_json::from_str(&text).map_err(|source| WorkflowError::Json {
            path: self.dir.join(name),
            stage,
            source,
        })
    }

    /// Path of an optional file, if the file exists.
    pub(crate) fn file_if_there(&self, name: &str) -> Option<PathBuf> {
        Some(self.reads_file(name)).filter(|path| path.is_file())
    }

    /// Creates an error about a missing table of the case.
    pub(crate) fn missing(&self, table: &str, what: &str) -> WorkflowError {
        let help = format!("Add a table [{table}]: it states {what}.");
        self.file.error(table, "", "is missing", help).into()
    }
}
