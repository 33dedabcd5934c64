//! Ensembles of simulations with a progress bar; an interrupted ensemble is resumed.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::Ordering;

use fem::{
    CurvePoint, Ensemble, EnsembleError, EnsembleProgress, FemError, Fields, Outcome, RunInput,
    RunRecord,
};

use crate::pipeline::neighbours::Neighbours;
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::progress::{Bar, speaker};
use crate::results_folder::error::WorkflowError;
use crate::results_folder::folder_copies::copy_records;
use crate::simulation::simulator::Simulator;

/// Returns the folder of the runs with this key. All neighbouring results folders, if there are any, share this folder.
/// After a change of the case, new runs are stored in another folder. If the change is undone, the runs in the old
/// folder are reused.
pub(crate) fn folder_of_runs(
    dir: &Path,
    neighbours: Option<&Neighbours>,
    folder: &str,
    key: &RunKey,
) -> PathBuf {
    let folder = neighbours.map_or_else(|| dir.join(folder), |others| others.runs(folder));
    folder.join(key.folder_name())
}

/// Runs that are computed together and stored in one folder.
#[derive(Clone, Copy)]
pub(crate) struct NamedRuns<'a> {
    /// Folder of the results folder that contains the folder of the runs.
    pub(crate) folder: &'a str,
    /// Description of the runs in the progress bar.
    pub(crate) label: &'a str,
    /// Identity of the runs.
    pub(crate) key: &'a RunKey,
    /// Names of the runs' inputs.
    pub(crate) names: &'a [String],
    pub(crate) runs: &'a [RunInput],
    /// Whether to wait for runs that other processes compute. Otherwise the computation ends as soon as other processes
    /// are computing all missing runs; only the records that exist at this time are then returned.
    pub(crate) wait: bool,
}

/// Computes a run. The arguments are the input of the run, the folder of the ensemble, and a function that reports the
/// completed fraction.
pub(crate) type RunJob<'a> =
    &'a (dyn Fn(&RunInput, &Path, &dyn Fn(f64)) -> Result<Outcome, FemError> + Sync);

/// Condition on the record of a failed run; the runs that meet the condition are computed again.
pub(crate) type Retry = Box<dyn Fn(&RunRecord) -> bool + Send + Sync>;

/// Computes the unfinished runs of `named` with simulators.
pub(crate) fn run_named<'s>(
    task: &Task<'_>,
    named: NamedRuns<'_>,
    simulator: &(dyn Fn(&RunInput) -> Result<Cow<'s, Simulator>, FemError> + Sync),
) -> Result<Vec<RunRecord>, WorkflowError> {
    let interrupt = task.interrupt;
    run_jobs(task, named, None, &|run, _, done| {
        let simulator = simulator(run)?;
        simulator.run(&run.inputs, &mut |point: &CurvePoint, _: &Fields| {
            done(simulator.fraction_done(point));
            match interrupt.load(Ordering::Relaxed) {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        })
    })
}

/// Computes the unfinished runs of `named`, and the failed runs that meet the condition `retry`.
pub(crate) fn run_jobs(
    task: &Task<'_>,
    named: NamedRuns<'_>,
    retry: Option<Retry>,
    job: RunJob<'_>,
) -> Result<Vec<RunRecord>, WorkflowError> {
    let NamedRuns { folder, label, key, names, runs, wait } = named;
    let unshared = folder_of_runs(&task.path(""), None, folder, key);
    let directory = folder_of_runs(&task.path(""), task.neighbours.as_ref(), folder, key);
    if directory != unshared {
        // reuse runs that were computed before the folder had neighbouring folders
        copy_records(&unshared, &directory)?;
    }
    // another version of the program may compute other results: the version is part of the fingerprint, so
    // that the runs of two versions are not mixed
    let fingerprint = format!("program = breccia {}\n{key}", env!("CARGO_PKG_VERSION"));
    let ensemble = Ensemble::open(&directory, &fingerprint).map_err(|error| match error {
        // the folder name already identifies everything but the program version
        EnsembleError::Foreign { directory, difference } => {
            WorkflowError::OtherProgram { path: directory, difference }
        }
        other => other.into(),
    })?;
    let mut ensemble = ensemble.leave_to_others(!wait);
    if let Some(retry) = retry {
        ensemble = ensemble.retry_failed_if(retry);
    }
    let (title, part) = (task.stage(), speaker());
    let bar = EnsembleBar { title, label, part, bar: OnceLock::new() };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let interrupt = task.interrupt;
    let threads = task.threads;
    let records = task.while_others_compute(|core| {
        ensemble.in_turn(move || Box::new(core())).run(
            runs,
            &names,
            threads,
            &|run, done| job(run, &directory, done),
            &bar,
            interrupt,
        )
    })?;
    task.check_interrupt()?;
    if directory != unshared {
        // each results folder keeps a copy of all runs from which its results were computed
        copy_records(&directory, &unshared)?;
    }
    Ok(records)
}

/// Progress bar that appears when the first run starts.
struct EnsembleBar<'a> {
    title: &'static str,
    label: &'a str,
    /// Name of the part of a study that messages show, if any. The name is stored because any thread may start
    /// the bar.
    part: Option<String>,
    bar: OnceLock<Bar>,
}

impl EnsembleBar<'_> {
    fn bar(&self) -> &Bar {
        self.bar.get_or_init(|| Bar::for_part(self.part.clone(), self.title, self.label))
    }
}

impl EnsembleProgress for EnsembleBar<'_> {
    fn update(&self, finished: usize, total: usize, fraction: f64) {
        if finished < total || self.bar.get().is_some() {
            self.bar().set(fraction, &format!("{finished} of {total}"));
        }
    }

    fn warning(&self, message: &str) {
        self.bar().note(message);
    }
}
