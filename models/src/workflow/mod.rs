//! The stages from a case to a report. Each stage reads files that earlier stages wrote.
//!
//! | stage | reads | writes |
//! |---|---|---|
//! | (opening) | the case and the files that it names | `case.toml` (includes all default values), `specimen.msh` or `experiments/` (copies), `origin.toml` (path of the case file) |
//! | segment | the image, labels of the user, or a packing to be scanned | `scan.tif` (virtual scan), `labels.tif`, `solid.tif` (grain fraction of each voxel; not for labels of the user), `grains.csv`, `segment.csv` (`quantity,value`), `slices.png`, `grains.png`, `grain_sizes.svg`; for each further image the tables, images and slices as `images/2-…` |
//! | mesh | `case.toml`; STL files of grains; `labels.tif`, `solid.tif`, `segment.csv` if the specimen is an image | `mesh.vtu` (regions, grains), `mesh.msh` (Gmsh 4.1), `mesh.csv` (`quantity,value`), `mesh.png` (view of the cut specimen), `mesh_quality.svg`; for each further image `meshes/2.msh`, `meshes/2.csv` |
//! | experiments | `mesh.msh`, `experiments/` | for virtual specimens `experiments/{specimens,truth,bias}.csv`, `experiments/curves/`; always `experiments.csv`, `curve_checks.csv` (`id,finding,value,help`) |
//! | ensemble | `mesh.msh` and `meshes/`, `labels.tif`, `solid.tif` and `images/` if the runs share one or more images; with `[sequential]` also `experiments.csv` | `ensemble/` (one file per run, for resuming), `runs.csv` (a [`Dataset`](::surrogate::Dataset)), `failed_runs.csv`, `curves/run-*.csv`, `quadrature.csv` if two quadratures of the damage terms are possible; with `[sequential]` `sequential.csv` (`batches,runs,parameter,contraction,surrogate_share`); with `[fidelity]` `curves/level-*.csv` (runs on more accurate meshes), `fidelity.csv` (`level,qoi,order,ratio,scatter_percent,error_percent,runs`), `fidelity_runs.csv` (as simulated), `fidelity.json` |
//! | surrogate | `runs.csv`, `experiments.csv` | `surrogate.json`, `surrogate_orders.csv`, `surrogate_error.json`, `surrogate_uncertainty.json` (posterior of its coefficients), `surrogate_specimens.json` (if runs share a few specimens: the error separated into scatter within and between specimens), `sobol.csv` (`qoi,input,first,first_q05,first_q95,total,total_q05,total_q95`) |
//! | calibrate | `surrogate.json`, `runs.csv`, `curves/run-*.csv`, `curves/level-*.csv`, `experiments.csv`, `experiments/` | `posterior.zarr`, `posterior.csv`, `predictive.csv`, `predictive_curves.csv` (`displacement_mm` and quantiles of the force of a new specimen), `sampling.csv`, `summary.csv`, `posterior.txt` (the summary as text), `range.csv` (`qoi,experiment_mean,low,high,inside`), `map.csv`, `fit.csv` (`qoi,experiment_mean,map_surrogate,percent_error,sd_percent,simulation_sd_percent,sample_bound_percent`), `uncertainty.csv`, `loo.csv` (`specimen,elpd,pareto_k`), `influence.csv` (`specimen,parameter,shift_sd,method`), `sensitivity.csv` (`parameter,prior,scatter_prior,likelihood,pareto_k,diagnosis`), with `calibration.evidence` `evidence.csv` (`ln_evidence,error`) |
//! | confirm | `map.csv`, `posterior.csv`, `mesh.msh` | `confirm.csv`, `confirm_runs.csv`, `curves/baseline.csv`, `curves/map.csv`, `curves/draw-*.csv`, `fields/map*` (`.vtu`, `.pvd`, pictures, `map.csv`), `curves/second-mesh.csv` |
//! | validate | `posterior.csv`, `surrogate.json`, `experiments.csv`; `mesh.msh`, `experiments.csv`, `experiments/` in the folder of each validation | `validation.csv` (one row for each validation, quantity and specimen), `validation_summary.csv` (for each validation and quantity), `validation_coverage.csv`, `validation_curves.csv` |
//! | verdict | results and warnings of the earlier stages | `verdict.csv` (`parameter,contraction,verdict`), `warnings.txt`, `summary.txt` |
//! | next-test | `posterior.csv`, `surrogate.json`, `experiments.csv`; runs and curves, for candidates with further quantities of existing curves | `next-test.csv` (`candidate,parameter,specimens,contraction,contraction_q05,contraction_q95,width90`), `next-test-specimens.csv` (`candidate,parameter,goal,value,specimens,limit`; `specimens` is empty if 1000 specimens do not reach the goal), `next-test-failed.csv` (`candidate,reason`: omitted candidates), `next-test/candidate-*.csv` (runs of each candidate, a [`Dataset`](::surrogate::Dataset)) |
//! | report | the results of all other stages | `report.html` |
//!
//! The runs come from a source (`run_sources/`, one file per source): simulations of this program, a program of the
//! user (`[simulator]`; a run works in `ensemble/*/work/run-*`), or an imported table (`imported_runs.csv`). Without
//! a specimen of this program, the stages `segment` and `mesh` write nothing, `confirm` writes no fields and no
//! second mesh, and runs without a curve have no file in `curves/`. `simulator/` and `experiments/values.csv` are
//! copies of files that the case names. A case with several tests has a results folder for each test, `tests/NAME`,
//! and the joint stages are run in the results folder of the case: see `joint` and `docs/how-to/several-tests.md`.
//! Each `[[validation]]` has a results folder `validation/NAME` with the products of the stages `segment`, `mesh` and
//! `experiments`, and its runs in `validation/NAME/runs/`.
//!
//! `breccia surfaces` writes the surface of each grain, `surfaces/grain-*.stl` and `surfaces.csv`. `breccia simulate`
//! runs one simulation. These two commands are not stages.
//!
//! `stages.toml` records for each finished stage the keys of the case and the files that the stage has read, and the
//! files that it has written. A stage is run again if any of these keys and files has changed. Therefore the same
//! command resumes after an interruption, and restores a deleted result. A stage that is run alone fails if a file that
//! it reads is out of date. A results folder belongs to one case.
//!
//! The warnings of a stage are in `warnings/<stage>.txt`; rules on the results (`rules/`, one file per rule) are
//! applied by the stage `verdict`. All warnings are counted on the screen and listed in `warnings.txt`, in
//! `summary.txt` and in the report.
//!
//! `written.csv` lists each file that the program has written, with the hash of its content. The entry is added
//! before the complete file is renamed to its final name. The program replaces and removes only files with a recorded
//! content. Later stages use an edited product (labels, a mesh, a copied curve) without changing
//! it; any other file of the user at the path of a product stops the stage before it computes, unless `--replace`
//! allows it.
//!
//! The results folders of a study have a common parent. If a stage in one of these folders has already computed
//! products from the same inputs, the same stage in another folder copies these products. Runs with the same inputs
//! are computed once, in the study's `runs/`. Each folder has its own copies of all files; a file system that can
//! share the blocks of copies stores equal files once.
//!
//! Any number of processes may work in one results folder, on all machines that can access the folder. The processes
//! share the runs of the stage `ensemble`. One process makes all products of a stage and holds a lock in `.locks/`
//! until the stage ends; the other processes wait. [`status`] reports the progress and changes nothing.

mod copies;
mod detach;
mod in_place;
mod joint_workflow;
mod one_stage;
mod ownership;
mod sharing;
mod simulate;
mod simulate_outside;
mod status;
mod surfaces;
#[cfg(test)]
mod tests;

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

pub use crate::check::case_check::CaseCheck;
pub use crate::check::expected_cost::ExpectedCost;
pub use crate::forward::laboratories::{SimulatedLaboratories, simulate_laboratories};
pub(crate) use crate::pipeline::neighbours::Together;
pub use crate::pipeline::stage::Stage;
pub(crate) use crate::results_folder::cores::Cores;
pub use crate::results_folder::error::{InputInPlace, WorkflowError};
pub use crate::results_folder::product_folder::FolderAccess;
pub(crate) use crate::results_folder::product_folder::{ProductFolder, create_file};
pub(crate) use crate::stages::table::FORMER_NAMES;
pub use crate::stages::table::STAGES;
use crate::stages::table::stages_of;
pub(crate) use copies::missing_case;
pub use detach::detach;
pub use joint_workflow::JointWorkflow;
pub use simulate::{DeviceChoice, simulate};
pub(crate) use status::check_begun;
pub use status::{RunCounts, StageState, StageStatus, status};
pub use surfaces::SurfaceOptions;

use crate::case::CaseFile;
use crate::experiments::validation_folders::{PREPARATION, VALIDATE, folder_of, held_out_cases};
use crate::pipeline::adoption::adopt_products;
use crate::pipeline::freshness::{Freshness, Records, STAGES_FILE, finished_in};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::neighbours::Neighbours;
use crate::pipeline::task::{StageRecord, Task};
use crate::progress::{say, speaking_for};
use crate::report::Results;
use crate::results_folder::editable::finished_before;
use crate::results_folder::locks::lock;
use crate::simulation::without_viscosity::without_viscosity;
use crate::stages::report;
use copies::Copies;
use in_place::check_inputs;

/// A case and the results folder in which its stages are run.
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
    cores: Cores,
    /// Priority when cores are scarce; the lowest rank gets the next free core.
    rank: usize,
    interrupt: &'a AtomicBool,
    accept_out_of_range: bool,
    copies: Copies,
    folder: ProductFolder,
    freshness: Freshness,
    neighbours: Option<Neighbours>,
    /// Folders of `[[validation]]`, with the names of the validations.
    validations: Vec<(String, Workflow<'a>)>,
    /// Whether the specimens are held out of the calibration.
    is_held_out: bool,
}

impl<'a> Workflow<'a> {
    /// Opens the results folder `dir` for a case, and makes it a self-contained copy of the case: copies the files that
    /// the case names, and writes `case.toml` with all default values.
    ///
    /// Once `interrupt` is true, running simulations end after their load step and
    /// [`WorkflowError::Interrupted`] is returned.
    ///
    /// # Errors
    /// Fails if a file that the case names has an error, if `dir` has the results of another case, or if `dir` cannot
    /// be written.
    pub fn open(
        source: &CaseFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
    ) -> Result<Self, WorkflowError> {
        Self::open_with(source, dir, threads, interrupt, &FolderAccess::default())
    }

    /// Opens the results folder like [`Workflow::open`]. `access` defines which existing results and files may be
    /// replaced.
    ///
    /// # Errors
    /// The errors of [`Workflow::open`].
    pub fn open_with(
        source: &CaseFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
        access: &FolderAccess,
    ) -> Result<Self, WorkflowError> {
        check_inputs(source, dir)?;
        let mut copies = Copies::of(source, dir)?;
        let folder = ProductFolder::new(dir, &access.replace);
        if finished_in(dir).is_empty() {
            // a `stages.toml` without records of finished stages can only be a file of the user
            folder.claim(STAGES_FILE, "run")?;
        }
        if !access.reuse {
            copies.check_owner(source, dir)?;
        }
        std::fs::create_dir_all(dir).map_err(|e| WorkflowError::results(dir, e))?;
        adopt_products(&folder, dir)?;
        folder.claim(STAGES_FILE, "run")?;
        copies.write(source, dir, &folder)?;
        // with several tests, the folder of each test has its validations
        let held_out = match source.case.tests.is_empty() {
            true => held_out_cases(source)?,
            false => Vec::new(),
        };
        // a file that only the case names must not have the path of a product of a validation
        for (name, _) in &held_out {
            check_inputs(source, &dir.join(folder_of(name)))?;
        }
        let mut validations = Vec::new();
        for (name, held_out) in held_out {
            // these folders belong to the folder of the case, whose owner has been checked
            let access = FolderAccess { reuse: true, replace: access.replace.clone() };
            let validation_folder = dir.join(folder_of(&name));
            let workflow =
                Self::open_with(&held_out, &validation_folder, threads, interrupt, &access)?;
            copies.add_originals_of(&workflow.copies);
            validations.push((name, Self { is_held_out: true, ..workflow }));
        }
        let (path, case) = (dir.join("case.toml"), copies.case.clone());
        // the case in the results folder contains the rows of tables instead of file names
        let file = CaseFile { path, case, table_files: Vec::new() };
        Ok(Self {
            file,
            dir: dir.to_owned(),
            threads,
            cores: Cores::new(threads),
            rank: 0,
            interrupt,
            accept_out_of_range: false,
            copies,
            folder,
            freshness: Freshness::default(),
            neighbours: Neighbours::of(dir),
            validations,
            is_held_out: false,
        })
    }

    /// Returns the same workflow, sharing `cores` with other workflows. The workflow with the lowest rank gets the next
    /// free core.
    pub(crate) fn among(self, cores: &Cores, rank: usize) -> Self {
        let validations = self.validations.into_iter();
        let validations =
            validations.map(|(name, workflow)| (name, workflow.among(cores, rank))).collect();
        Self { cores: cores.clone(), rank, validations, ..self }
    }

    /// Returns the same workflow, which calibrates even if the data are outside the range of the simulations. No
    /// parameter is then reported as identified.
    pub fn accept_out_of_range(self) -> Self {
        Self { accept_out_of_range: true, ..self }
    }

    /// Runs every stage that is not finished.
    ///
    /// # Errors
    /// The error that ended a stage.
    pub fn run_all(&self) -> Result<(), WorkflowError> {
        self.check_ready()?;
        self.report_before_runs();
        self.stages().iter().try_for_each(|stage| self.make(stage))
    }

    /// Prints a line if the specimens are virtual, and warns if the runs may not pass their peak.
    fn report_before_runs(&self) {
        without_viscosity(&self.file.case).iter().for_each(|warning| say("warning", warning));
        let experiments = self.file.case.experiments.as_ref();
        if let Some(specimens) = experiments.and_then(|e| e.virtual_specimens.as_ref()) {
            let count = specimens.specimens;
            let text = format!(
                "no specimen is measured: {count} virtual specimens are simulated with known parameters \
                 ([experiments.virtual])"
            );
            say("note", &text);
        }
    }

    /// Stages that are run in this folder, in order.
    fn stages(&self) -> &'static [Stage] {
        stages_of(&self.file.case)
    }

    /// Checks the inputs and the paths of all products before anything is computed.
    ///
    /// # Errors
    /// Fails if an input has an error, or if a file of the user has the path of a product.
    fn check_ready(&self) -> Result<(), WorkflowError> {
        if self.file.case.tests.is_empty() {
            let ready = self.file.table().and_then(|_| self.file.check_steps());
            ready.map_err(|e| self.copies.named_by_owner(e.into()))?;
        }
        self.validations.iter().try_for_each(|(_, workflow)| workflow.check_ready())?;
        let finished = self.finished();
        for stage in self.stages().iter().filter(|stage| !finished.contains_key(stage.name)) {
            let case = &self.file.case;
            let may_write = |name: &str| Stage::may_write(case, name);
            self.folder.claim_unwritten(stage.products_of(case), stage.name, may_write)?;
        }
        Ok(())
    }

    fn inputs(&self) -> Inputs<'_> {
        let inputs = Inputs::new(&self.file, &self.dir, Stage::that_writes);
        if self.is_held_out { inputs.of_held_out() } else { inputs }
    }

    fn make(&self, stage: &'static Stage) -> Result<(), WorkflowError> {
        if stage.name == VALIDATE {
            let before = STAGES.iter().filter(|stage| PREPARATION.contains(&stage.name));
            self.validations.iter().try_for_each(|(name, workflow)| {
                speaking_for(name, || before.clone().try_for_each(|stage| workflow.make(stage)))
            })?;
        }
        let before = self.finished();
        if let Some(earlier) = before.get(stage.name) {
            match self.change(earlier) {
                None => {
                    say(stage.name, &finished_before(&earlier.edited(&self.dir)));
                    return self.remove_leftovers(stage, earlier);
                }
                Some(change) => say(stage.name, &format!("again, since {change}")),
            }
        }
        let start = Instant::now();
        self.claim(stage)?;
        self.share_work(stage, &before, false)?;
        // only one of several processes writes the products; the other processes wait, and find the stage
        // finished afterwards
        let _lock = lock(&self.dir, stage.name, stage.name, self.interrupt)?;
        // the stage runs in only one of the neighbouring folders with the same specimen; its products are then copied
        // to the other folders
        let _of_neighbours = match &self.neighbours {
            Some(neighbours) if stage.is_of_the_specimen() => {
                Some(neighbours.lock(stage.name, &self.inputs(), self.interrupt)?)
            }
            _ => None,
        };
        let finished = self.finished();
        if let Some(earlier) = finished.get(stage.name)
            && self.change(earlier).is_none()
        {
            say(stage.name, "finished by another process");
            return Ok(());
        }
        let (result, record) = match self.taken_over(stage, &finished)? {
            Some(taken) => taken,
            None => self.with_task(stage, &finished, |task| {
                let result = (stage.run)(&task)?;
                task.write_warnings()?;
                Ok((result, task.trace()))
            })?,
        };
        let elapsed = start.elapsed().as_secs_f64();
        say(stage.name, &format!("{result}; elapsed time {elapsed:.1} s"));
        self.remove_leftovers(stage, &record)?;
        self.remember(stage, record)
    }

    /// Runs `work` with the task of a stage. Reading an out-of-date file through the task fails.
    fn with_task<T>(
        &self,
        stage: &'static Stage,
        finished: &Records,
        work: impl FnOnce(Task<'_>) -> Result<T, WorkflowError>,
    ) -> Result<T, WorkflowError> {
        self.freshness.clear();
        let unguarded = self.inputs();
        let reported = RefCell::new(BTreeSet::new());
        let guard = |name: &str| {
            let checked = self.freshness.check(name, finished, &unguarded, &self.dir);
            for edited in self.freshness.edited().into_values().flatten() {
                if reported.borrow_mut().insert(edited.clone()) {
                    say(stage.name, &format!("{edited} was edited and is used as it is"));
                }
            }
            checked
        };
        let inputs = self.inputs().guarded(&guard);
        let cores = (&self.cores, self.threads, self.rank);
        let mut task = Task::among(stage.name, inputs, &self.dir, cores, self.interrupt);
        task.neighbours.clone_from(&self.neighbours);
        task.accept_out_of_range = self.accept_out_of_range;
        task.folder.clone_from(&self.folder);
        work(task).map_err(|error| self.copies.named_by_owner(error))
    }

    /// Adds the record of a stage to `stages.toml`. Records that other processes have added in the meantime are kept.
    fn remember(&self, stage: &Stage, record: StageRecord) -> Result<(), WorkflowError> {
        let _lock = lock(&self.dir, "stages", stage.name, self.interrupt)?;
        let mut finished = self.finished();
        finished.insert(stage.name.to_owned(), record);
        let text = toml::to_string(&finished).expect("names and fingerprints are plain text");
        self.folder.write(STAGES_FILE, stage.name, text.as_bytes()).map(drop)
    }

    /// Returns the reason, as text, why a stage has to be run; `None` if the stage is finished and its inputs and
    /// products are unchanged.
    pub fn due(&self, stage: &Stage) -> Option<String> {
        match self.finished().get(stage.name) {
            None => Some("it has not been run".to_owned()),
            Some(record) => self.change(record),
        }
    }

    fn finished(&self) -> Records {
        finished_in(&self.dir)
    }

    /// Returns the contents of the report; all stages must be finished.
    ///
    /// # Errors
    /// Fails if a result is missing or cannot be read.
    pub(crate) fn results(&self) -> Result<Results, WorkflowError> {
        report::load(&self.inputs()).map_err(|error| self.copies.named_by_owner(error))
    }

    /// The results folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }
}
