//! The stages from a case to a report, each reading the files that the one before wrote.
//!
//! | stage | reads | writes |
//! |---|---|---|
//! | (opening) | the case and what it names | `case.toml` (every default written out), `specimen.msh` or `laboratory/` (copies) |
//! | mesh | `case.toml` | `mesh.vtu` (regions, grains), `mesh.msh` (Gmsh 4.1), `mesh.csv` (`quantity,value`), `mesh.svg` (picture) |
//! | laboratory | `mesh.msh`, `laboratory/` | virtual: `laboratory/{specimens,truth,bias}.csv`, `laboratory/curves/`; `experiments.csv` |
//! | ensemble | `mesh.msh` | `runs/` (one file a run, for resuming), `runs.csv`, `curves/run-*.csv` |
//! | surrogate | `runs.csv` | `surrogate.json`, `surrogate_orders.csv`, `surrogate_error.json` |
//! | calibrate | `surrogate.json`, `experiments.csv` | `posterior.zarr`, `posterior.csv`, `sampling.csv`, `summary.csv`, `summary.txt`, `warnings.txt`, `map.csv` |
//! | confirm | `map.csv`, `posterior.csv`, `mesh.msh` | `confirm.csv`, `confirm_runs.csv`, `curves/map.csv`, `curves/draw-*.csv` |
//! | report | all of these | `report.html` |
//!
//! `stages.toml` remembers what each finished stage was made from. A stage is done again when that
//! has changed, so the same command after an interruption goes on where it stopped.

mod calibrate;
mod campaign;
mod confirm;
mod ensemble;
mod error;
mod files;
mod fingerprint;
mod laboratory;
mod mesh;
mod report;
mod simulate;
mod simulation;
mod surrogate;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

pub use error::WorkflowError;
pub use simulate::simulate;

use crate::case::{Case, CaseFile, PriorCase};
use crate::experiment::SpecimenTable;
use crate::progress::say;
use files::write;
use fingerprint::Fingerprint;

/// A step of the workflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Geometry to tetrahedra.
    Mesh,
    /// Specimens, measured or virtual, to quantities of interest.
    Laboratory,
    /// The simulations of the design.
    Ensemble,
    /// Polynomial chaos from the simulations.
    Surrogate,
    /// Posterior and MAP.
    Calibrate,
    /// Simulations at the MAP and at posterior draws.
    Confirm,
    /// Figures and tables on one page.
    Report,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; 7] = [
        Self::Mesh,
        Self::Laboratory,
        Self::Ensemble,
        Self::Surrogate,
        Self::Calibrate,
        Self::Confirm,
        Self::Report,
    ];

    /// Its subcommand.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Laboratory => "laboratory",
            Self::Ensemble => "ensemble",
            Self::Surrogate => "surrogate",
            Self::Calibrate => "calibrate",
            Self::Confirm => "confirm",
            Self::Report => "report",
        }
    }

    /// The last file that it writes.
    fn product(self) -> &'static str {
        match self {
            Self::Mesh => "mesh.csv",
            Self::Laboratory => "experiments.csv",
            Self::Ensemble => "runs.csv",
            Self::Surrogate => "surrogate.json",
            Self::Calibrate => "map.csv",
            Self::Confirm => "confirm.csv",
            Self::Report => "report.html",
        }
    }
}

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
        let curves = dir.join("curves");
        std::fs::create_dir_all(&curves).map_err(|e| WorkflowError::io(&curves, &e))?;
        let mut file = CaseFile { path: dir.join("case.toml"), case: source.case.clone() };
        if let Some(mesh) = &mut file.case.specimen.mesh {
            let (from, to) = (source.beside(mesh), dir.join("specimen.msh"));
            if !same_file(&from, &to) {
                std::fs::copy(&from, &to).map_err(|e| WorkflowError::io(&from, &e))?;
            }
            *mesh = "specimen.msh".into();
        }
        if let Some(table) = file.case.experiments.as_mut().and_then(|e| e.table.as_mut()) {
            let (from, to) = (source.beside(table), dir.join("laboratory/specimens.csv"));
            let specimens = SpecimenTable::read(&from)?;
            if !same_file(&from, &to) {
                for (path, text) in specimens.to_files() {
                    write(&dir.join("laboratory").join(path), &text)?;
                }
            }
            *table = "laboratory/specimens.csv".into();
        }
        write(&file.path, &file.case.to_toml())?;
        Ok(Self { file, dir: dir.to_owned(), threads, interrupt })
    }

    /// Runs every stage that is not finished already.
    ///
    /// # Errors
    /// What ended a stage.
    pub fn run_all(&self) -> Result<(), WorkflowError> {
        Stage::ALL.into_iter().try_for_each(|stage| self.run(stage))
    }

    /// Runs one stage, unless it is finished and what it was made from is unchanged.
    ///
    /// # Errors
    /// What ended the stage; a stage before it that has not been run.
    pub fn run(&self, stage: Stage) -> Result<(), WorkflowError> {
        let inputs = match stage {
            Stage::Mesh => mesh::inputs(self),
            Stage::Laboratory => laboratory::inputs(self),
            Stage::Ensemble => ensemble::inputs(self),
            Stage::Surrogate => surrogate::inputs(self),
            Stage::Calibrate => calibrate::inputs(self),
            Stage::Confirm => confirm::inputs(self),
            Stage::Report => report::inputs(self),
        }?;
        let record = self.path("stages.toml");
        let mut finished: BTreeMap<String, String> = std::fs::read_to_string(&record)
            .ok()
            .and_then(|text| toml::from_str(&text).ok())
            .unwrap_or_default();
        let current = inputs.to_string();
        let unchanged = finished.get(stage.name()) == Some(&current);
        if unchanged && self.path(stage.product()).is_file() {
            say(stage.name(), "finished before, unchanged");
            return Ok(());
        }
        let start = Instant::now();
        let result = match stage {
            Stage::Mesh => mesh::run(self),
            Stage::Laboratory => laboratory::run(self),
            Stage::Ensemble => ensemble::run(self),
            Stage::Surrogate => surrogate::run(self),
            Stage::Calibrate => calibrate::run(self),
            Stage::Confirm => confirm::run(self),
            Stage::Report => report::run(self),
        }?;
        say(stage.name(), &format!("{result} ({:.1} s)", start.elapsed().as_secs_f64()));
        finished.insert(stage.name().to_owned(), current);
        let text = toml::to_string(&finished).expect("names and fingerprints are plain text");
        write(&record, &text)
    }

    /// The directory of the results.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    fn case(&self) -> &Case {
        &self.file.case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    /// A file that `stage` must have written.
    fn needed(&self, name: &str, stage: Stage) -> Result<PathBuf, WorkflowError> {
        let path = self.path(name);
        if path.is_file() {
            Ok(path)
        } else {
            Err(WorkflowError::Missing { path, stage: stage.name() })
        }
    }

    fn prior(&self) -> Result<&PriorCase, WorkflowError> {
        self.case().prior.as_ref().ok_or_else(|| self.missing_part("prior", "what is calibrated"))
    }

    fn missing_part(&self, part: &str, what: &str) -> WorkflowError {
        self.file
            .error(part, "", "is missing", format!("Add a table [{part}]: it says {what}."))
            .into()
    }

    fn check_interrupt(&self) -> Result<(), WorkflowError> {
        if self.interrupt.load(Ordering::Relaxed) {
            Err(WorkflowError::Interrupted)
        } else {
            Ok(())
        }
    }

    /// What every simulation on the case's mesh depends on.
    fn simulation_inputs(&self) -> Result<Fingerprint, WorkflowError> {
        let case = self.case();
        Ok(Fingerprint::new()
            .file(&self.needed("mesh.msh", Stage::Mesh)?)?
            .part(&case.specimen.order)
            .part(&case.material)
            .part(&case.phase_field)
            .part(&case.test)
            .part(&case.prior))
    }
}

fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}
