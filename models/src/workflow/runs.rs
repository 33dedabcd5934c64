//! Many simulations with a bar, resumed after an interruption.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::Ordering;

use fem::{
    CurvePoint, Ensemble, EnsembleError, EnsembleProgress, FemError, Fields, RunInput, RunRecord,
};

use super::WorkflowError;
use super::content_hash::ContentHash;
use super::folder_copies::copy_records;
use super::neighbours::Neighbours;
use super::simulator::Simulator;
use super::task::Task;
use crate::progress::{Bar, speaker};

/// Runs what is not finished yet of an ensemble in `folder/<fingerprint>`, one simulator a run.
///
/// The fingerprint is that of everything which the stage has read until now, so that every ensemble has
/// a folder of its own: a changed case starts a new one and loses nothing, and a case changed back finds
/// its runs again.
pub(super) fn run_ensemble<'s>(
    task: &Task<'_>,
    folder: &str,
    names: &[String],
    runs: &[RunInput],
    simulator: &(dyn Fn(&RunInput) -> Result<Cow<'s, Simulator>, FemError> + Sync),
) -> Result<Vec<RunRecord>, WorkflowError> {
    run_named(task, folder, &task.inputs.manifest(), names, runs, true, simulator)
}

/// The place of the runs of a kind that are named by this manifest: where neighbours make them too, theirs.
pub(super) fn place(
    dir: &Path,
    neighbours: Option<&Neighbours>,
    folder: &str,
    manifest: &str,
) -> PathBuf {
    let folder = neighbours.map_or_else(|| dir.join(folder), |others| others.runs(folder));
    folder.join(ContentHash::of(manifest).to_string())
}

/// The same for runs that are named by a part of what the stage has read. Unless it shall `wait`, it ends
/// once other processes make all that is missing, with the records at hand.
pub(super) fn run_named<'s>(
    task: &Task<'_>,
    folder: &str,
    manifest: &str,
    names: &[String],
    runs: &[RunInput],
    wait: bool,
    simulator: &(dyn Fn(&RunInput) -> Result<Cow<'s, Simulator>, FemError> + Sync),
) -> Result<Vec<RunRecord>, WorkflowError> {
    let own = place(&task.path(""), None, folder, manifest);
    let directory = place(&task.path(""), task.neighbours.as_ref(), folder, manifest);
    if directory != own {
        // made before there were neighbours
        copy_records(&own, &directory)?;
    }
    // another version may compute something else: its runs are not mixed with those of this one
    let fingerprint = format!("program = breccia {}\n{manifest}", env!("CARGO_PKG_VERSION"));
    let ensemble = Ensemble::open(&directory, &fingerprint).map_err(|error| match error {
        // all else is in the folder's name
        EnsembleError::Foreign { directory, difference } => {
            WorkflowError::OtherProgram { path: directory, difference }
        }
        other => other.into(),
    })?;
    let ensemble = ensemble.leave_to_others(!wait);
    let bar = EnsembleBar { title: task.stage(), of: speaker(), bar: OnceLock::new() };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let interrupt = task.interrupt;
    let threads = task.threads;
    let records = task.while_others_compute(|core| {
        ensemble.in_turn(move || Box::new(core())).run(
            runs,
            &names,
            threads,
            &|run, done| {
                let simulator = simulator(run)?;
                simulator.run(&run.inputs, &mut |point: &CurvePoint, _: &Fields| {
                    done(simulator.fraction_done(point));
                    match interrupt.load(Ordering::Relaxed) {
                        true => ControlFlow::Break(()),
                        false => ControlFlow::Continue(()),
                    }
                })
            },
            &bar,
            interrupt,
        )
    })?;
    task.check_interrupt()?;
    if directory != own {
        // each folder of results has all that it was made from
        copy_records(&directory, &own)?;
    }
    Ok(records)
}

/// A bar that is shown once there is something to do.
struct EnsembleBar {
    title: &'static str,
    /// For whom the ensemble is made; the bar may be begun by any of its threads.
    of: Option<String>,
    bar: OnceLock<Bar>,
}

impl EnsembleBar {
    fn bar(&self) -> &Bar {
        self.bar.get_or_init(|| Bar::of(self.of.clone(), self.title))
    }
}

impl EnsembleProgress for EnsembleBar {
    fn update(&self, finished: usize, total: usize, fraction: f64) {
        if finished < total || self.bar.get().is_some() {
            self.bar().set(fraction, &format!("{finished} of {total} runs"));
        }
    }

    fn warning(&self, message: &str) {
        self.bar().note(message);
    }
}
