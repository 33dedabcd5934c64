//! Context of a running stage: inputs, products and warnings.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::inputs::Inputs;
use super::neighbours::Neighbours;
use crate::case::Case;
use crate::progress::say;
use crate::results_folder::content_hash::ContentHash;
use crate::results_folder::cores::{Core, Cores};
use crate::results_folder::editable::is_editable;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::warnings_of;
use crate::results_folder::product_folder::ProductFolder;
use crate::results_folder::sources::{Move, Sources};
use crate::table::to_csv;

/// Record of the inputs and the products of a run of a stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct StageRecord {
    /// Version of the program; another version may compute other results.
    program: String,
    #[serde(flatten)]
    sources: Sources,
    products: BTreeMap<String, String>,
}

impl StageRecord {
    /// Returns the reason, as text, why the stage has to be run again; `None` if the stage is up to date. A stage with
    /// an edited product counts as up to date.
    pub(crate) fn change(&self, inputs: &Inputs<'_>, dir: &Path) -> Option<String> {
        if !self.edited(dir).is_empty() {
            return None;
        }
        let is_damaged = |name: &&String| match is_editable(name) {
            true => !dir.join(name).exists(),
            false => !self.wrote(name, dir),
        };
        let damaged = || self.products.keys().find(is_damaged);
        self.source_change(inputs)
            .or_else(|| damaged().map(|name| format!("{name} is missing or was changed")))
    }

    /// Editable products that the user has edited; later stages use these products without changing
    /// them.
    pub(crate) fn edited(&self, dir: &Path) -> Vec<&str> {
        let editable = self.products().filter(|name| is_editable(name));
        editable.filter(|name| dir.join(name).exists() && !self.wrote(name, dir)).collect()
    }

    /// Describes the first changed input of the stage; `None` if no input has changed.
    pub(crate) fn source_change(&self, inputs: &Inputs<'_>) -> Option<String> {
        if self.program != env!("CARGO_PKG_VERSION") {
            return Some("another version of the program ran it".to_owned());
        }
        inputs.change(&self.sources)
    }

    /// Returns the record of the same stage in a copy of the results folder.
    pub(crate) fn moved(self, moved: &Move<'_>) -> Self {
        let product = |(name, sum): (String, String)| {
            let (_, sum) = moved.file(&name, &sum);
            (name, sum)
        };
        let products = self.products.into_iter().map(product).collect();
        Self { sources: self.sources.moved(moved), products, ..self }
    }

    /// Names of the files that the stage has read.
    pub(crate) fn files_read(&self) -> impl Iterator<Item = &str> {
        self.sources.files()
    }

    /// Names of the files that the stage has read, with the hashes of their contents.
    pub(crate) fn contents_read(&self) -> impl Iterator<Item = (&str, &str)> {
        self.sources.contents()
    }

    /// Names of the stage's products.
    pub(crate) fn products(&self) -> impl Iterator<Item = &str> {
        self.products.keys().map(String::as_str)
    }

    /// Names of the stage's products with the hashes of their contents.
    pub(crate) fn contents(&self) -> impl Iterator<Item = (&str, ContentHash)> {
        self.products.iter().filter_map(|(name, sum)| Some((name.as_str(), sum.parse().ok()?)))
    }

    /// Whether a file or folder is a product of the stage.
    pub(crate) fn has_written(&self, name: &str) -> bool {
        self.products.contains_key(name)
    }

    /// Whether a product still has the content that the stage wrote.
    pub(crate) fn wrote(&self, name: &str, dir: &Path) -> bool {
        let now = ContentHash::of_path(&dir.join(name)).map(|sum| sum.to_string());
        self.products.get(name).is_some_and(|sum| now.is_ok_and(|now| now == *sum))
    }
}

/// Context of a running stage: the case and the results of earlier stages, the products, and the warnings. A stage
/// depends on everything that is read through its task.
pub struct Task<'a> {
    pub(crate) inputs: Inputs<'a>,
    pub(crate) threads: usize,
    pub(crate) interrupt: &'a AtomicBool,
    /// Neighbouring folders with which runs are shared.
    pub(crate) neighbours: Option<Neighbours>,
    /// Whether to calibrate even if the data are outside the range of the simulations.
    pub(crate) accept_out_of_range: bool,
    /// Whether the stage ends without waiting for work that other processes are doing.
    pub(crate) leave_to_others: bool,
    /// Name of the stage.
    stage: &'static str,
    dir: &'a Path,
    pub(crate) folder: ProductFolder,
    /// Names of the products and the fingerprints of their contents.
    products: RefCell<BTreeMap<String, String>>,
    /// Warnings of the stage so far.
    warnings: RefCell<Vec<String>>,
    cores: Cores,
    /// Priority when cores are scarce; the lowest rank gets the next free core.
    rank: usize,
    /// Core on which the stage computes; `None` while the stage waits for its runs.
    core: RefCell<Option<Core>>,
}

impl<'a> Task<'a> {
    /// Creates a task with a separate pool of `threads` cores.
    pub(crate) fn new(
        stage: &'static str,
        inputs: Inputs<'a>,
        dir: &'a Path,
        threads: usize,
        interrupt: &'a AtomicBool,
    ) -> Self {
        Self::among(stage, inputs, dir, (&Cores::new(threads), threads, 0), interrupt)
    }

    /// Creates a task that shares `cores` with other tasks. Waits until a core is free.
    pub(crate) fn among(
        stage: &'static str,
        inputs: Inputs<'a>,
        dir: &'a Path,
        (cores, threads, rank): (&Cores, usize, usize),
        interrupt: &'a AtomicBool,
    ) -> Self {
        Self {
            inputs,
            threads,
            interrupt,
            neighbours: None,
            cores: cores.clone(),
            rank,
            core: RefCell::new(Some(cores.take(rank))),
            accept_out_of_range: false,
            leave_to_others: false,
            stage,
            dir,
            folder: ProductFolder::new(dir, &[]),
            products: RefCell::default(),
            warnings: RefCell::default(),
        }
    }

    /// Creates a task of the same stage and folder with other inputs. Products of the new task are not recorded as
    /// products of this task.
    pub(crate) fn with<'b>(&self, inputs: Inputs<'b>) -> Task<'b>
    where
        'a: 'b,
    {
        let mut task = Task::new(self.stage, inputs, self.dir, self.threads, self.interrupt);
        task.folder = self.folder.clone();
        task
    }

    /// The name of the stage.
    pub(crate) fn stage(&self) -> &'static str {
        self.stage
    }

    /// Releases the core of the stage while `work` is executed, because each run in `work` takes a core from the
    /// pool.
    pub(crate) fn while_others_compute<T>(
        &self,
        work: impl FnOnce(Box<dyn Fn() -> Core + Send + Sync>) -> T,
    ) -> T {
        self.core.replace(None);
        let (cores, rank) = (self.cores.clone(), self.rank);
        let done = work(Box::new(move || cores.take(rank)));
        self.core.replace(Some(self.cores.take(self.rank)));
        done
    }

    /// Calls `work` with the number of threads that it may use: one plus the number of spare cores, but at most `most`.
    pub(crate) fn on_threads<T>(&self, most: usize, work: impl FnOnce(usize) -> T) -> T {
        let spare = self.cores.spare(most.min(self.threads).saturating_sub(1));
        work(1 + spare.len())
    }

    /// The case with all default values. The stage is run again after each change of the case.
    pub fn case(&self) -> &Case {
        self.inputs.case()
    }

    /// Path of a file that an earlier stage has written, such as `posterior.csv`.
    ///
    /// # Errors
    /// If the file does not exist, or if the stage that writes the file has to be run again.
    pub fn file(&self, name: &str) -> Result<PathBuf, WorkflowError> {
        self.inputs.file(name)
    }

    /// Text of a file that an earlier stage has written.
    ///
    /// # Errors
    /// The errors of [`Task::file`], and if the file cannot be read.
    pub fn text(&self, name: &str) -> Result<String, WorkflowError> {
        self.inputs.text(name)
    }

    /// Path of a file or folder in the results folder that is not a product, such as the folder of an ensemble.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// Writes a product with the function `write`. The complete product is then renamed to its final name.
    ///
    /// # Errors
    /// Fails if a file of the user has the path of the product. Returns the errors of the function
    /// `write`, too.
    pub(crate) fn product<E>(
        &self,
        name: &str,
        write: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<(), WorkflowError>
    where
        WorkflowError: From<E>,
    {
        let content = self.folder.write_with(name, self.stage, write)?;
        self.remember(name, content);
        Ok(())
    }

    /// Writes a product. Its name is one of the declared products of the stage.
    ///
    /// # Errors
    /// Fails if a file of the user has the path of the product, or if the file cannot be written.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), WorkflowError> {
        let content = self.folder.write(name, self.stage, content.as_ref())?;
        self.remember(name, content);
        Ok(())
    }

    fn remember(&self, name: &str, content: ContentHash) {
        debug_assert_eq!(self.inputs.writer_of(name), Some(self.stage), "{name} is not declared");
        self.products.borrow_mut().insert(name.to_owned(), content.to_string());
    }

    /// Issues a warning about an error that the intervals do not include, or about a reason to doubt the result. The
    /// warning is printed and recorded for the stage `verdict`.
    pub fn warn(&self, text: &str) {
        say("warning", text);
        self.warnings.borrow_mut().push(text.replace('\n', " "));
    }

    /// Writes the warnings of the stage to its file, if there are any. Called at the end of the stage.
    ///
    /// # Errors
    /// Fails if a file of the user has the path of this file, or if the folder cannot be written.
    pub(crate) fn write_warnings(&self) -> Result<(), WorkflowError> {
        let lines: String = self.warnings.borrow().iter().map(|line| format!("{line}\n")).collect();
        if lines.is_empty() {
            return Ok(());
        }
        self.write(&warnings_of(self.stage), lines)
    }

    /// Writes a product as a CSV table.
    ///
    /// # Errors
    /// The errors of [`Task::write`].
    pub fn write_csv<H, R>(
        &self,
        name: &str,
        header: H,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<(), WorkflowError>
    where
        H: IntoIterator<Item: AsRef<[u8]>>,
        R: IntoIterator<Item: AsRef<[u8]>>,
    {
        let text = to_csv(header, rows).map_err(|e| WorkflowError::io(&self.path(name), e))?;
        self.write(name, text)
    }

    /// Writes a product as JSON.
    pub(crate) fn write_json(
        &self,
        name: &str,
        value: &impl Serialize,
    ) -> Result<(), WorkflowError> {
        let text = serde_json::to_vec_pretty(value);
        let mut text = text.map_err(|e| WorkflowError::io(&self.path(name), e.into()))?;
        text.push(b'\n');
        self.write(name, text)
    }

    /// Returns an error if the user has interrupted the program. A stage that computes for long calls this repeatedly.
    ///
    /// # Errors
    /// [`WorkflowError::Interrupted`].
    pub fn check_interrupt(&self) -> Result<(), WorkflowError> {
        match self.interrupt.load(Ordering::Relaxed) {
            true => Err(WorkflowError::Interrupted),
            false => Ok(()),
        }
    }

    /// Returns the record of the inputs and the products of the stage.
    pub(crate) fn trace(self) -> StageRecord {
        StageRecord {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            sources: self.inputs.sources(),
            products: self.products.into_inner(),
        }
    }
}

impl fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Task")
            .field("stage", &self.stage)
            .field("dir", &self.dir)
            .finish_non_exhaustive()
    }
}
