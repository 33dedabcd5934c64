//! Ensembles that others look at, or work on, while they run.

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
fn a_look_from_outside_finds_what_ended_and_what_is_under_way() {
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

    // a lock that its process has left behind is none, and half a file is no record
    fs::write(dir.path().join(".run-000009.json.lock"), "").unwrap();
    fs::write(dir.path().join("run-000002.json"), "{ \"id\": 2,").unwrap();
    let state = at(dir.path());
    assert_eq!((state.records.len(), state.under_way, state.damaged), (3, vec![], vec![2]));
    let file = dir.path().join("run-000001.json");
    assert!(matches!(EnsembleState::of(&file), Err(EnsembleError::Io { .. })));
}

#[test]
fn what_another_process_makes_can_be_left_to_it() {
    let dir = tempfile::tempdir().unwrap();
    let helped = Mutex::new(Vec::new());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        if run.id == 2 {
            // while run 2 is under way here, another makes the rest and does not wait for it
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

/// On a file system whose locks reach one machine only, two make the same run: the first record stays.
#[test]
fn a_run_that_was_made_twice_is_kept_once_and_told() {
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
