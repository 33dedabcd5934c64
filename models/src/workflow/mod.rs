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
//! `stages.toml` remembers what each finished stage was made from and what came out. A stage is done
//! again when one of them has changed, so the same command after an interruption goes on where it
//! stopped, and mends a damaged result.

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

    /// What it writes beside its product for later stages to read.
    fn read_later(self) -> &'static [&'static str] {
        match self {
            Self::Mesh => &["mesh.msh"],
            Self::Surrogate => &["surrogate_error.json"],
            Self::Calibrate => &["posterior.csv"],
            Self::Laboratory | Self::Ensemble | Self::Confirm | Self::Report => &[],
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
        let curves = dir.join("curves");
        std::fs::create_dir_all(&curves).map_err(|e| WorkflowError::results(&curves, &e))?;
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
            if from.is_file() {
                let specimens = SpecimenTable::read(&from)?;
                if !same_file(&from, &to) {
                    for (path, text) in specimens.to_files() {
                        write(&dir.join("laboratory").join(path), &text)?;
                    }
                }
                *table = "laboratory/specimens.csv".into();
            } else {
                // a mesh can be made before the specimens are tested; the laboratory stage asks again
                *table = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, &e))?;
            }
        }
        write(&file.path, &file.case.to_toml())?;
        Ok(Self { file, dir: dir.to_owned(), threads, interrupt })
    }

    /// Runs every stage that is not finished already.
    ///
    /// # Errors
    /// What ended a stage.
    pub fn run_all(&self) -> Result<(), WorkflowError> {
        self.file.table()?;
        Stage::ALL.into_iter().try_for_each(|stage| self.run(stage))
    }

    /// Runs one stage, unless it is finished and what it was made from and what it made are unchanged.
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
        let state = |made: Fingerprint| format!("{inputs} {made}");
        let unchanged = self
            .made(stage)
            .is_ok_and(|made| finished.get(stage.name()).is_some_and(|s| *s == state(made)));
        if unchanged {
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
        finished.insert(stage.name().to_owned(), state(self.made(stage)?));
        let text = toml::to_string(&finished).expect("names and fingerprints are plain text");
        write(&record, &text)
    }

    /// The content of a stage's results that later stages read.
    fn made(&self, stage: Stage) -> Result<Fingerprint, WorkflowError> {
        stage
            .read_later()
            .iter()
            .chain([&stage.product()])
            .try_fold(Fingerprint::new(), |made, name| made.file(&self.path(name)))
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

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
        [experiments]\ntable = \"specimens.csv\"\n";

    #[test]
    fn a_damaged_result_is_made_again() {
        let dir = tempfile::tempdir().unwrap();
        let (source, out) = (dir.path().join("case.toml"), dir.path().join("out"));
        let interrupt = AtomicBool::new(false);
        let case = CaseFile::parse(CASE, &source).unwrap();
        let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
        workflow.run(Stage::Mesh).unwrap();
        let whole = std::fs::read(out.join("mesh.msh")).unwrap();
        std::fs::write(out.join("mesh.msh"), &whole[..whole.len() / 2]).unwrap();
        workflow.run(Stage::Mesh).unwrap();
        assert_eq!(std::fs::read(out.join("mesh.msh")).unwrap(), whole);
    }

    #[test]
    fn the_specimen_table_is_needed_from_the_laboratory_on_and_heights_are_in_mm() {
        let dir = tempfile::tempdir().unwrap();
        let (source, out) = (dir.path().join("case.toml"), dir.path().join("out"));
        let interrupt = AtomicBool::new(false);
        let case = CaseFile::parse(CASE, &source).unwrap();
        let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
        workflow.run(Stage::Mesh).unwrap();
        let missing = workflow.run(Stage::Laboratory).unwrap_err().to_string();
        assert!(missing.contains("experiments.table") && missing.contains("no such"), "{missing}");

        std::fs::create_dir(dir.path().join("curves")).unwrap();
        let table = "id,height_mm,radius_mm,group\nS-1,4400,2.5,50C\n";
        std::fs::write(dir.path().join("specimens.csv"), table).unwrap();
        let curve = "displacement_mm,force_N\n0,0\n0.05,80\n0.1,140\n0.12,147\n0.14,140\n";
        std::fs::write(dir.path().join("curves/S-1.csv"), curve).unwrap();
        let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
        let slip = workflow.run(Stage::Laboratory).unwrap_err().to_string();
        for part in ["specimens.csv", "S-1", "height_mm = 4400", "4.4000 mm", "in mm"] {
            assert!(slip.contains(part), "{part:?} is not in {slip:?}");
        }
    }
}
