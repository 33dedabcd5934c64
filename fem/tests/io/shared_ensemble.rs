//! Ensembles that other processes read, or compute together with this process, at the same time.

use std::fs;
use std::path::Path;
use std::sync::Mutex;

use fem::{
    End, Ensemble, EnsembleError, EnsembleProgress, EnsembleState, FemError, Outcome, RunInput,
};

use super::ensemble::{NAMES, NEVER, in_directory, outcome, runs, simple};

fn at(directory: &Path) -> EnsembleState {
    EnsembleState::of(directory).unwrap()
}

#[test]
fn the_state_of_an_ensemble_contains_ended_runs_and_runs_in_progress() {
    let dir = tempfile::tempdir().unwrap();
    assert_eq!(at(&dir.path().join("none")), EnsembleState::default());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        let state = at(dir.path());
        let ended: Vec<usize> = state.records.iter().map(|record| record.id).collect();
        assert_eq!((ended, state.under_way), ((1..run.id).collect(), vec![run.id]));
        simple(run, done)
    };
    let records = in_directory(dir.path()).run(&runs(4), &NAMES, 1, &job, &(), &NEVER).unwrap();
    assert!(records.iter().all(|record| record.status == fem::RunStatus::Finished), "{records:?}");
    assert_eq!(at(dir.path()), EnsembleState { records, ..EnsembleState::default() });

    // the lock file of an ended process is not a lock, and an incomplete file is not a record
    fs::write(dir.path().join(".run-000009.json.lock"), "").unwrap();
    fs::write(dir.path().join("run-000002.json"), "{ \"id\": 2,").unwrap();
    let state = at(dir.path());
    assert_eq!((state.records.len(), state.under_way, state.damaged), (3, vec![], vec![2]));
    let file = dir.path().join("run-000001.json");
    assert!(matches!(EnsembleState::of(&file), Err(EnsembleError::Io { .. })));
}

#[test]
fn a_process_need_not_wait_for_runs_of_other_processes() {
    let dir = tempfile::tempdir().unwrap();
    let helped = Mutex::new(Vec::new());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        if run.id == 2 {
            // while run 2 is in progress, another ensemble computes all other runs and does not wait for run 2
            let other = in_directory(dir.path()).leave_to_others(true);
            let records = other.run(&runs(5), &NAMES, 2, &simple, &(), &NEVER).unwrap();
            helped.lock().unwrap().extend(records.iter().map(|record| record.id));
        }
        simple(run, done)
    };
    let records = in_directory(dir.path()).run(&runs(5), &NAMES, 1, &job, &(), &NEVER).unwrap();
    assert_eq!(helped.into_inner().unwrap(), [1, 3, 4, 5]);
    assert_eq!(records.len(), 5);
}

#[derive(Default)]
struct Warnings(Mutex<Vec<String>>);

impl EnsembleProgress for Warnings {
    fn warning(&self, message: &str) {
        self.0.lock().unwrap().push(message.into());
    }
}

/// On a file system whose locks are visible on one machine only, two processes may compute the same run. The first record
/// is used.
#[test]
fn a_run_that_is_computed_twice_is_stored_once_with_a_warning() {
    let elsewhere = tempfile::tempdir().unwrap();
    let other = |run: &RunInput, _: &dyn Fn(f64)| -> Result<Outcome, FemError> {
        Ok(outcome(run, End::BelowPeak))
    };
    let ensemble: Ensemble = in_directory(elsewhere.path());
    let first = ensemble.run(&runs(1), &NAMES, 1, &other, &(), &NEVER).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        let name = "run-000001.json";
        fs::copy(elsewhere.path().join(name), dir.path().join(name)).unwrap();
        simple(run, done)
    };
    let warnings = Warnings::default();
    let records =
        in_directory(dir.path()).run(&runs(1), &NAMES, 1, &job, &warnings, &NEVER).unwrap();
    assert_eq!(records, first);
    assert_eq!(at(dir.path()).records, first);
    let warnings = warnings.0.into_inner().unwrap().join("\n");
    assert!(warnings.contains("run 1 was computed twice"), "{warnings}");
}
