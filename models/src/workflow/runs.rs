//! Many simulations with a bar, resumed after an interruption.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use fem::{CurvePoint, Ensemble, EnsembleProgress, FemError, Fields, RunInput, RunRecord};

use super::WorkflowError;
use super::content_hash::ContentHash;
use super::simulator::Simulator;
use super::task::Task;
use crate::progress::Bar;

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
    run_named(task, folder, &task.inputs.manifest(), names, runs, simulator)
}

/// The same for runs that are named by a part of what the stage has read.
pub(super) fn run_named<'s>(
    task: &Task<'_>,
    folder: &str,
    manifest: &str,
    names: &[String],
    runs: &[RunInput],
    simulator: &(dyn Fn(&RunInput) -> Result<Cow<'s, Simulator>, FemError> + Sync),
) -> Result<Vec<RunRecord>, WorkflowError> {
    let directory = task.path(folder).join(ContentHash::of(manifest).to_string());
    let ensemble = Ensemble::open(directory, manifest)?;
    let bar = EnsembleBar(Bar::new(task.stage()));
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let interrupt = task.interrupt;
    let records = ensemble.run(
        runs,
        &names,
        task.threads,
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
    )?;
    task.check_interrupt()?;
    Ok(records)
}

struct EnsembleBar(Bar);

impl EnsembleProgress for EnsembleBar {
    fn update(&self, finished: usize, total: usize, fraction: f64) {
        self.0.set(fraction, &format!("{finished} of {total} runs"));
    }

    fn warning(&self, message: &str) {
        self.0.note(message);
    }
}
