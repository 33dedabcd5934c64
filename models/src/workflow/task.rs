//! A stage at work: what it reads, and what it leaves behind.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::WorkflowError;
use super::content_hash::ContentHash;
use super::cores::{Core, Cores};
use super::files::write;
use super::inputs::Inputs;
use super::links::part_from_other_names;
use super::neighbours::Neighbours;
use super::sources::Sources;
use crate::table::to_csv;

/// What a run of a stage has read and written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StageRecord {
    /// The program's version: another one may compute something else.
    program: String,
    #[serde(flatten)]
    sources: Sources,
    products: BTreeMap<String, String>,
}

impl StageRecord {
    /// Why the stage has to be run again, in words; nothing if it has not.
    pub(super) fn change(&self, inputs: &Inputs<'_>, dir: &Path) -> Option<String> {
        let damaged = || self.products.keys().find(|name| !self.wrote(name, dir));
        self.source_change(inputs)
            .or_else(|| damaged().map(|name| format!("{name} is missing or was changed")))
    }

    /// What has changed of all that the stage has read, in words.
    pub(super) fn source_change(&self, inputs: &Inputs<'_>) -> Option<String> {
        if self.program != env!("CARGO_PKG_VERSION") {
            return Some("another version of the program ran it".to_owned());
        }
        inputs.change(&self.sources)
    }

    /// Names of the files that it has read.
    pub(super) fn files_read(&self) -> impl Iterator<Item = &str> {
        self.sources.files()
    }

    /// Names of its products.
    pub(super) fn products(&self) -> impl Iterator<Item = &str> {
        self.products.keys().map(String::as_str)
    }

    /// Whether a file or folder is one of its products.
    pub(super) fn has_written(&self, name: &str) -> bool {
        self.products.contains_key(name)
    }

    /// Whether a product is as it was written.
    pub(super) fn wrote(&self, name: &str, dir: &Path) -> bool {
        let now = ContentHash::of_path(&dir.join(name)).map(|sum| sum.to_string());
        self.products.get(name).is_some_and(|sum| now.is_ok_and(|now| now == *sum))
    }
}

/// What a stage works with.
pub(super) struct Task<'a> {
    pub(super) inputs: Inputs<'a>,
    pub(super) threads: usize,
    pub(super) interrupt: &'a AtomicBool,
    /// Folders that share their runs with this one.
    pub(super) neighbours: Option<Neighbours>,
    /// Whether a calibration goes on against data that no simulation reaches.
    pub(super) accept_out_of_range: bool,
    /// Whether work that other processes do is not waited for.
    pub(super) leave_to_others: bool,
    /// Name of the stage.
    stage: &'static str,
    dir: &'a Path,
    products: RefCell<Vec<String>>,
    cores: Cores,
    /// Who is served first where cores are scarce.
    rank: usize,
    /// What the stage computes on, unless it waits for its runs.
    core: RefCell<Option<Core>>,
}

impl<'a> Task<'a> {
    /// A stage at work on as many cores as it has threads.
    pub(super) fn new(
        stage: &'static str,
        inputs: Inputs<'a>,
        dir: &'a Path,
        threads: usize,
        interrupt: &'a AtomicBool,
    ) -> Self {
        Self::among(stage, inputs, dir, (&Cores::new(threads), threads, 0), interrupt)
    }

    /// The same where others compute on the cores too: it waits for one.
    pub(super) fn among(
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
            products: RefCell::default(),
        }
    }

    /// The same stage at work with other inputs in this folder, which it does not remember as its own.
    pub(super) fn with<'b>(&self, inputs: Inputs<'b>) -> Task<'b>
    where
        'a: 'b,
    {
        Task::new(self.stage, inputs, self.dir, self.threads, self.interrupt)
    }

    /// The name of the stage.
    pub(super) fn stage(&self) -> &'static str {
        self.stage
    }

    /// Works on runs that wait for cores themselves: the stage's own is free meanwhile.
    pub(super) fn while_others_compute<T>(
        &self,
        work: impl FnOnce(Box<dyn Fn() -> Core + Send + Sync>) -> T,
    ) -> T {
        self.core.replace(None);
        let (cores, rank) = (self.cores.clone(), self.rank);
        let done = work(Box::new(move || cores.take(rank)));
        self.core.replace(Some(self.cores.take(self.rank)));
        done
    }

    /// Works on so many threads at most, as there are cores that nobody else needs.
    pub(super) fn on_threads<T>(&self, most: usize, work: impl FnOnce(usize) -> T) -> T {
        let spare = self.cores.spare(most.min(self.threads).saturating_sub(1));
        work(1 + spare.len())
    }

    /// A place of the results that is no product, such as the directory of an ensemble.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// The place of a product that is about to be written; its folder is made.
    pub(super) fn product(&self, name: &str) -> Result<PathBuf, WorkflowError> {
        debug_assert_eq!(self.inputs.writer_of(name), Some(self.stage), "{name} is not declared");
        self.products.borrow_mut().push(name.to_owned());
        let path = self.dir.join(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| WorkflowError::io(folder, e))?;
        }
        part_from_other_names(&path)?;
        Ok(path)
    }

    /// Writes a product.
    pub(super) fn write(&self, name: &str, text: &str) -> Result<(), WorkflowError> {
        write(&self.product(name)?, text.as_bytes())
    }

    /// Writes a table.
    pub(super) fn write_csv<H, R>(
        &self,
        name: &str,
        header: H,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<(), WorkflowError>
    where
        H: IntoIterator<Item: AsRef<[u8]>>,
        R: IntoIterator<Item: AsRef<[u8]>>,
    {
        let path = self.product(name)?;
        let text = to_csv(header, rows).map_err(|e| WorkflowError::io(&path, e))?;
        write(&path, &text)
    }

    /// Writes a value as JSON.
    pub(super) fn write_json(
        &self,
        name: &str,
        value: &impl Serialize,
    ) -> Result<(), WorkflowError> {
        let path = self.product(name)?;
        let mut text =
            serde_json::to_vec_pretty(value).map_err(|e| WorkflowError::io(&path, e.into()))?;
        text.push(b'\n');
        write(&path, &text)
    }

    pub(super) fn check_interrupt(&self) -> Result<(), WorkflowError> {
        match self.interrupt.load(Ordering::Relaxed) {
            true => Err(WorkflowError::Interrupted),
            false => Ok(()),
        }
    }

    /// What was read and written.
    pub(super) fn trace(self) -> Result<StageRecord, WorkflowError> {
        let products = self.products.into_inner().into_iter().map(|name| {
            let path = self.dir.join(&name);
            let sum = ContentHash::of_path(&path).map_err(|e| WorkflowError::io(&path, e))?;
            Ok((name, sum.to_string()))
        });
        Ok(StageRecord {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            sources: self.inputs.sources(),
            products: products.collect::<Result<_, WorkflowError>>()?,
        })
    }
}
