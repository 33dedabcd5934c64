//! The stages from a case to a report, each reading the files that the one before wrote.
//!
//! | stage | reads | writes |
//! |---|---|---|
//! | (opening) | the case and what it names | `case.toml` (every default written out), `specimen.msh` or `experiments/` (copies) |
//! | segment | the image, or a packing to be scanned | `scan.tif` (virtual), `labels.tif`, `solid.tif` (part of each voxel that is grain), `grains.csv`, `segment.csv` (`quantity,value`), `slices.png`, `grains.png`, `grain_sizes.svg` |
//! | mesh | `case.toml`; `labels.tif`, `solid.tif`, `segment.csv` where there is an image | `mesh.vtu` (regions, grains), `mesh.msh` (Gmsh 4.1), `mesh.csv` (`quantity,value`), `mesh.png` (cut open), `mesh_quality.svg` |
//! | experiments | `mesh.msh`, `experiments/` | virtual: `experiments/{specimens,truth,bias}.csv`, `experiments/curves/`; `experiments.csv` |
//! | ensemble | `mesh.msh` | `ensemble/` (one file a run, for resuming), `runs.csv` (a [`surrogate::Dataset`]), `failed_runs.csv`, `curves/run-*.csv` |
//! | surrogate | `runs.csv` | `surrogate.json`, `surrogate_orders.csv`, `surrogate_error.json` |
//! | calibrate | `surrogate.json`, `experiments.csv` | `posterior.zarr`, `posterior.csv`, `sampling.csv`, `summary.csv`, `summary.txt`, `warnings.txt`, `map.csv`, `uncertainty.csv` |
//! | confirm | `map.csv`, `posterior.csv`, `mesh.msh` | `confirm.csv`, `confirm_runs.csv`, `curves/map.csv`, `curves/draw-*.csv`, `curves/finer-map.csv` |
//! | report | all of these | `report.html` |
//!
//! `stages.toml` remembers what each finished stage has read, key by key of the case and file by file,
//! and what it wrote. A stage is done again when one of them has changed, so the same command after an
//! interruption goes on where it stopped, and repairs a damaged result.

mod calibrate;
mod confirm;
mod content_hash;
mod ensemble;
mod error;
mod experiments;
mod files;
mod inputs;
mod mesh;
mod packings;
mod report;
mod runs;
mod segment;
mod simulate;
mod simulator;
mod specimen;
mod stage;
mod stages;
mod surrogate;
mod task;
#[cfg(test)]
mod tests;
mod uncertainty;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

pub use error::WorkflowError;
pub use simulate::simulate;
pub use stage::Stage;
pub use stages::STAGES;

use crate::case::CaseFile;
use crate::experiment::SpecimenTable;
use crate::progress::say;
use files::{SPECIMENS, same_file, write};
use inputs::Inputs;
use task::{StageRecord, Task};

/// A case being worked on in a directory.
///
/// # Example
/// ```no_run
/// use std::sync::atomic::AtomicBool;
/// use models::{CaseFile, Workflow};
///
/// let interrupt = AtomicBool::new(false);
/// let case = CaseFile::read("case.toml".as_ref())?;
/// let workflow = Workflow::open(&case, "results".as_ref(), 2, &interrupt)?;
/// workflow.run_all()?;
/// # Ok::<(), models::WorkflowError>(())
/// ```
#[derive(Debug)]
pub struct Workflow<'a> {
    file: CaseFile,
    dir: PathBuf,
    threads: usize,
    interrupt: &'a AtomicBool,
}

impl<'a> Workflow<'a> {
    /// Makes `dir` a self-contained copy of the case: what it names is copied, and `case.toml`
    /// written with every default.
    ///
    /// Once `interrupt` is true, running simulations end after their load step and
    /// [`WorkflowError::Interrupted`] is returned.
    ///
    /// # Errors
    /// A file that the case names is wrong; the directory cannot be written.
    pub fn open(
        source: &CaseFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
    ) -> Result<Self, WorkflowError> {
        std::fs::create_dir_all(dir).map_err(|e| WorkflowError::results(dir, e))?;
        let mut file = CaseFile { path: dir.join("case.toml"), case: source.case.clone() };
        if let Some(mesh) = &mut file.case.specimen.mesh {
            let (from, to) = (source.beside(mesh), dir.join("specimen.msh"));
            if !same_file(&from, &to) {
                std::fs::copy(&from, &to).map_err(|e| WorkflowError::io(&from, e))?;
            }
            *mesh = "specimen.msh".into();
        }
        if let Some(stack) = file.case.specimen.image.as_mut().and_then(|i| i.stack.as_mut()) {
            // too large to be copied
            let from = source.beside(stack);
            *stack = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
        }
        if let Some(table) = file.case.experiments.as_mut().and_then(|e| e.table.as_mut()) {
            let (from, to) = (source.beside(table), dir.join(SPECIMENS));
            if from.is_file() {
                let specimens = SpecimenTable::read(&from)?;
                if !same_file(&from, &to) {
                    let files = specimens.to_files().map_err(|e| WorkflowError::io(&to, e))?;
                    for (path, text) in files {
                        write(&dir.join("experiments").join(path), &text)?;
                    }
                }
                *table = SPECIMENS.into();
            } else {
                // a mesh can be made before the specimens are tested; the experiments stage asks again
                *table = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
            }
        }
        write(&file.path, file.case.to_toml().as_bytes())?;
        Ok(Self { file, dir: dir.to_owned(), threads, interrupt })
    }

    /// Runs every stage that is not finished already.
    ///
    /// # Errors
    /// What ended a stage.
    pub fn run_all(&self) -> Result<(), WorkflowError> {
        self.file.table()?;
        STAGES.iter().try_for_each(|stage| self.run(stage))
    }

    /// Runs one stage, unless it is finished and what it read and what it wrote are unchanged.
    ///
    /// # Errors
    /// What ended the stage; a stage before it that has not been run.
    pub fn run(&self, stage: &'static Stage) -> Result<(), WorkflowError> {
        let mut finished = self.finished();
        let earlier = finished.get(stage.name).cloned();
        let inputs = Inputs::new(&self.file, &self.dir, Stage::that_writes);
        if let Some(earlier) = &earlier {
            match earlier.change(&inputs, &self.dir) {
                None => {
                    say(stage.name, "finished before, unchanged");
                    return Ok(());
                }
                Some(change) => say(stage.name, &format!("again, since {change}")),
            }
        }
        let start = Instant::now();
        let task = Task::new(stage.name, inputs, &self.dir, self.threads, self.interrupt);
        let result = (stage.run)(&task)?;
        say(stage.name, &format!("{result} ({:.1} s)", start.elapsed().as_secs_f64()));
        let trace = task.trace()?;
        if let Some(earlier) = earlier {
            earlier.remove_stale(&trace, &self.dir)?;
        }
        finished.insert(stage.name.to_owned(), trace);
        let text = toml::to_string(&finished).expect("names and fingerprints are plain text");
        write(&self.dir.join("stages.toml"), text.as_bytes())
    }

    /// Why a stage has to be run, in words; nothing if it is finished and nothing that it read or wrote
    /// has changed.
    pub fn due(&self, stage: &Stage) -> Option<String> {
        match self.finished().get(stage.name) {
            None => Some("it has not been run".to_owned()),
            Some(trace) => {
                trace.change(&Inputs::new(&self.file, &self.dir, Stage::that_writes), &self.dir)
            }
        }
    }

    /// The stages that have been run to their end.
    fn finished(&self) -> BTreeMap<String, StageRecord> {
        std::fs::read_to_string(self.dir.join("stages.toml"))
            .ok()
            .and_then(|text| toml::from_str(&text).ok())
            .unwrap_or_default()
    }

    /// The directory of the results.
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}
