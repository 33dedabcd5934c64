//! Ensembles: no run is lost and no run is computed twice, even if a process is killed.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use fem::{
    CurvePoint, End, Ensemble, EnsembleError, EnsembleProgress, FemError, Outcome, RunEnd,
    RunInput, RunRecord, RunStatus, Sensitivities,
};

const FINGERPRINT: &str = "mesh = cylinder\nload = 0.22 mm";
pub(super) const NAMES: [&str; 2] = ["young_mpa", "viscosity_mpa_s"];
const CHILD_DIRECTORY: &str = "FEM_ENSEMBLE_TEST_DIRECTORY";
pub(super) static NEVER: AtomicBool = AtomicBool::new(false);

pub(super) fn runs(count: usize) -> Vec<RunInput> {
    (1..=count).map(|id| RunInput { id, inputs: vec![250.0 + id as f64 / 3.0, 0.1] }).collect()
}

/// Result of a fast replacement for a simulation; it depends only on the inputs.
pub(super) fn outcome(run: &RunInput, end: End) -> Outcome {
    let point = |k: usize| CurvePoint {
        time_s: k as f64 / 7.0,
        force_n: run.inputs[0] * (k as f64).sin(),
        ..CurvePoint::default()
    };
    Outcome { curve: (0..20).map(point).collect(), end, ..Outcome::default() }
}

pub(super) fn simple(run: &RunInput, _: &dyn Fn(f64)) -> Result<Outcome, FemError> {
    Ok(outcome(run, End::Displacement))
}

fn never_called(run: &RunInput, _: &dyn Fn(f64)) -> Result<Outcome, FemError> {
    panic!("run {} is computed a second time", run.id)
}

fn without_seconds(mut records: Vec<RunRecord>) -> Vec<RunRecord> {
    records.iter_mut().for_each(|record| record.seconds = 0.0);
    records
}

pub(super) fn in_directory(directory: &Path) -> Ensemble {
    Ensemble::open(directory, FINGERPRINT).unwrap()
}

#[test]
fn records_do_not_depend_on_the_number_of_threads_and_are_not_computed_again() {
    let runs = runs(12);
    let directories = [1, 3].map(|threads| (threads, tempfile::tempdir().unwrap()));
    let all = directories.each_ref().map(|(threads, dir)| {
        in_directory(dir.path()).run(&runs, &NAMES, *threads, &simple, &(), &NEVER).unwrap()
    });
    assert_eq!(without_seconds(all[0].clone()), without_seconds(all[1].clone()));
    assert_eq!(all[0].iter().map(|r| r.id).collect::<Vec<_>>(), (1..=12).collect::<Vec<_>>());
    assert_eq!(all[0][4].curve, outcome(&runs[4], End::Displacement).curve);

    // the records are read from the disk, bitwise equal and in the requested order
    let mut backwards = runs.clone();
    backwards.reverse();
    let dir = directories[0].1.path();
    let again = in_directory(dir).run(&backwards, &NAMES, 2, &never_called, &(), &NEVER).unwrap();
    assert_eq!(again.into_iter().rev().collect::<Vec<_>>(), all[0]);

    // the directory contains only the manifest, its lock and the runs
    let files: BTreeSet<String> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(files.len(), 14, "{files:?}");
}

#[test]
fn derivatives_are_stored_with_their_curve() {
    let dir = tempfile::tempdir().unwrap();
    let differentiated = |run: &RunInput, _: &dyn Fn(f64)| {
        let force_n = vec![vec![0.1 * run.inputs[0], 1.0 / 3.0]; 20];
        let sensitivities = Sensitivities {
            names: NAMES.map(String::from).into(),
            force_n,
            ..Sensitivities::default()
        };
        Ok(Outcome { sensitivities, ..outcome(run, End::Displacement) })
    };
    let ensemble = in_directory(dir.path());
    let made = ensemble.run(&runs(2), &NAMES, 1, &differentiated, &(), &NEVER).unwrap();
    let again = ensemble.run(&runs(2), &NAMES, 1, &never_called, &(), &NEVER).unwrap();
    assert_eq!(again, made);
    assert_eq!(again[1].sensitivities.force_n[19], [0.1 * runs(2)[1].inputs[0], 1.0 / 3.0]);
    // records of runs without derivatives, and records of earlier versions, have no entry for derivatives
    let plain = in_directory(tempfile::tempdir().unwrap().path())
        .run(&runs(1), &NAMES, 1, &simple, &(), &NEVER)
        .unwrap();
    let text = serde_json::to_string(&plain[0]).unwrap();
    assert!(plain[0].sensitivities.is_empty() && !text.contains("sensitivities"), "{text}");
    assert_eq!(serde_json::from_str::<RunRecord>(&text).unwrap(), plain[0]);
}

#[test]
fn failures_are_recorded_with_their_reason_and_the_ensemble_continues() {
    let dir = tempfile::tempdir().unwrap();
    let failure = || FemError::OtherFields { nodes: 3, expected: 4 };
    let job = |run: &RunInput, _: &dyn Fn(f64)| match run.id {
        2 => Err(failure()),
        3 => Ok(outcome(run, End::Failed(failure()))),
        4 => panic!("index out of bounds"),
        5 => {
            let mut outcome = outcome(run, End::BelowPeak);
            outcome.curve[3].force_n = f64::NAN;
            Ok(outcome)
        }
        6 => Ok(outcome(run, End::Interrupted)),
        _ => Ok(outcome(run, End::BelowPeak)),
    };
    let runs = runs(7);
    let records = in_directory(dir.path()).run(&runs, &NAMES, 2, &job, &(), &NEVER).unwrap();
    let reason = |id: usize| match &records[id - 1].status {
        RunStatus::Failed(reason) => reason.as_str(),
        RunStatus::Finished => "",
    };
    assert!(reason(2).contains("have 3 nodes") && reason(3).contains("have 3 nodes"));
    assert_eq!(
        (records[1].curve.len(), records[2].curve.len()),
        (0, 20),
        "the curve up to the failure"
    );
    assert!(reason(4).contains("panicked: index out of bounds"));
    assert!(reason(5).contains("not finite"));
    assert!(reason(6).contains("stopped by its observer"));
    assert_eq!(
        (records[4].curve.len(), records[5].curve.len()),
        (3, 20),
        "the curve of a failed run is stored"
    );
    assert_eq!((records[6].end, &records[6].status), (RunEnd::BelowPeak, &RunStatus::Finished));

    // failed runs are computed again only on request
    let ensemble = in_directory(dir.path());
    let again = ensemble.run(&runs, &NAMES, 2, &never_called, &(), &NEVER).unwrap();
    assert_eq!(again, records);
    let made = Mutex::new(BTreeSet::new());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        made.lock().unwrap().insert(run.id);
        simple(run, done)
    };
    let ensemble = in_directory(dir.path()).retry_failed(true);
    let retried = ensemble.run(&runs, &NAMES, 2, &job, &(), &NEVER).unwrap();
    assert!(retried.iter().all(|record| record.status == RunStatus::Finished));
    assert_eq!(made.into_inner().unwrap(), BTreeSet::from([2, 3, 4, 5, 6]));
}

/// Values by name are stored and read again; values that are not finite make a run fail. Failed runs that meet a condition
/// are computed again, and no other runs.
#[test]
fn values_are_stored_and_failed_runs_are_repeated_under_a_condition() {
    let dir = tempfile::tempdir().unwrap();
    let job = |run: &RunInput, _: &dyn Fn(f64)| match run.id {
        2 => Err(FemError::OtherProgram("stopped (limit 1 s)".into())),
        3 => Err(FemError::OtherProgram("crashed".into())),
        id => {
            let last = if id == 4 { f64::NAN } else { 0.5 };
            let values = [("u_mm".to_owned(), 7.0), ("f_Hz".to_owned(), last)].into();
            Ok(Outcome { values, ..Outcome::default() })
        }
    };
    let runs = runs(5);
    in_directory(dir.path()).run(&runs, &NAMES, 2, &job, &(), &NEVER).unwrap();
    let again = in_directory(dir.path()).run(&runs, &NAMES, 2, &never_called, &(), &NEVER);
    let records = again.unwrap();
    let statuses: Vec<String> = records.iter().map(|run| format!("{:?}", run.status)).collect();
    for (k, part) in [(0, "Finished"), (1, "limit 1 s"), (2, "crashed"), (3, "f_Hz = NaN")] {
        assert!(statuses[k].contains(part), "{statuses:?}");
    }
    assert_eq!(records[4].values["f_Hz"], 0.5);
    assert_eq!(records[3].values.keys().collect::<Vec<_>>(), ["u_mm"]);

    let made = Mutex::new(BTreeSet::new());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        made.lock().unwrap().insert(run.id);
        simple(run, done)
    };
    let is_of_limit = |run: &RunRecord| matches!(&run.status, RunStatus::Failed(reason) if reason.ends_with("s)"));
    let ensemble = in_directory(dir.path()).retry_failed_if(is_of_limit);
    let retried = ensemble.run(&runs, &NAMES, 2, &job, &(), &NEVER).unwrap();
    assert_eq!(made.into_inner().unwrap(), BTreeSet::from([2]));
    assert_eq!(retried[1].status, RunStatus::Finished);
    assert_eq!(retried[2], records[2]);
}

#[test]
fn an_interrupted_ensemble_resumes() {
    let dir = tempfile::tempdir().unwrap();
    let interrupt = AtomicBool::new(false);
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        if run.id == 4 {
            interrupt.store(true, Ordering::Relaxed);
            return Ok(outcome(run, End::Interrupted));
        }
        simple(run, done)
    };
    let runs = runs(9);
    let first = in_directory(dir.path()).run(&runs, &NAMES, 1, &job, &(), &interrupt).unwrap();
    assert_eq!(first.iter().map(|record| record.id).collect::<Vec<_>>(), [1, 2, 3]);

    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        assert!(run.id > 3, "run {} is computed a second time", run.id);
        simple(run, done)
    };
    let rest = in_directory(dir.path()).run(&runs, &NAMES, 1, &job, &(), &NEVER).unwrap();
    assert!(rest.len() == 9 && rest.iter().all(|record| record.status == RunStatus::Finished));
    assert_eq!(rest[..3], first);
}

#[derive(Default)]
struct Listener {
    started: AtomicUsize,
    ended: AtomicUsize,
    shares: Mutex<Vec<f64>>,
    warnings: Mutex<Vec<String>>,
}

impl EnsembleProgress for Listener {
    fn update(&self, finished: usize, total: usize, done: f64) {
        assert!(finished <= total && finished as f64 <= done * total as f64 + 1e-9);
        self.shares.lock().unwrap().push(done);
    }
    fn started(&self, _: usize) {
        self.started.fetch_add(1, Ordering::Relaxed);
    }
    fn ended(&self, _: &RunRecord) {
        self.ended.fetch_add(1, Ordering::Relaxed);
    }
    fn warning(&self, message: &str) {
        self.warnings.lock().unwrap().push(message.into());
    }
}

#[test]
fn progress_is_reported_and_runs_of_damaged_files_are_computed_again() {
    let dir = tempfile::tempdir().unwrap();
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        done(0.25);
        done(0.5);
        simple(run, done)
    };
    let runs = runs(4);
    let listener = Listener::default();
    let records = in_directory(dir.path()).run(&runs, &NAMES, 1, &job, &listener, &NEVER).unwrap();
    let shares = listener.shares.into_inner().unwrap();
    assert_eq!(shares[..5], [0.0, 0.0625, 0.125, 0.25, 0.3125]);
    assert_eq!(shares.last(), Some(&1.0));
    assert_eq!((listener.started.into_inner(), listener.ended.into_inner()), (4, 4));

    let file = dir.path().join("run-000002.json");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, &text[..text.len() / 2]).unwrap();
    fs::copy(dir.path().join("run-000001.json"), dir.path().join("run-000003.json")).unwrap();
    let listener = Listener::default();
    let again = in_directory(dir.path()).run(&runs, &NAMES, 1, &job, &listener, &NEVER).unwrap();
    assert_eq!(without_seconds(again), without_seconds(records));
    assert_eq!(listener.started.into_inner(), 2);
    let warnings = listener.warnings.into_inner().unwrap().join("\n");
    for part in ["run-000002.json is damaged", "run 2 is computed again", "it contains run 1"] {
        assert!(warnings.contains(part), "{warnings}");
    }
    // the damaged files are renamed, not deleted
    let aside = fs::read_to_string(dir.path().join("run-000002.json.damaged")).unwrap();
    assert_eq!(aside, &text[..text.len() / 2]);
    assert!(warnings.contains("renamed to"), "{warnings}");
}

/// The checksum detects an edited record, even if the record is valid JSON.
#[test]
fn an_edited_record_is_neither_used_nor_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let runs = runs(3);
    let made = in_directory(dir.path()).run(&runs, &NAMES, 1, &simple, &(), &NEVER).unwrap();
    let file = dir.path().join("run-000002.json");
    let text = fs::read_to_string(&file).unwrap();
    let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
    // a change of white space does not change the checksum
    fs::write(&file, value.to_string()).unwrap();
    let again = in_directory(dir.path()).run(&runs, &NAMES, 1, &never_called, &(), &NEVER).unwrap();
    assert_eq!(again, made);

    for point in value["record"]["curve"].as_array_mut().unwrap() {
        point["force_n"] = (1.3 * point["force_n"].as_f64().unwrap()).into();
    }
    let without_checksum = value["record"].to_string();
    for edited in [value.to_string(), without_checksum.clone()] {
        fs::write(&file, &edited).unwrap();
        let error =
            in_directory(dir.path()).run(&runs, &NAMES, 1, &never_called, &(), &NEVER).unwrap_err();
        assert!(matches!(error, EnsembleError::Edited { id: 2, .. }), "{error}");
        for part in ["run-000002.json", "checksum", "neither used nor replaced", "restore"] {
            assert!(error.to_string().contains(part), "{error}");
        }
        let state = fem::EnsembleState::of(dir.path()).unwrap();
        assert_eq!((state.records.len(), state.edited, state.damaged), (2, vec![2], vec![]));
        assert_eq!(fs::read_to_string(&file).unwrap(), edited);
    }

    // a directory of the earlier format, whose records have no checksums, is still read
    let manifest = dir.path().join("ensemble.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"format\": 2", "\"format\": 1")).unwrap();
    let again = in_directory(dir.path()).run(&runs, &NAMES, 1, &never_called, &(), &NEVER).unwrap();
    assert_eq!(again[1].curve[3].force_n, 1.3 * made[1].curve[3].force_n);
    fs::write(&manifest, text.replace("\"format\": 2", "\"format\": 3")).unwrap();
    let error = Ensemble::open(dir.path(), FINGERPRINT).unwrap_err();
    assert!(matches!(error, EnsembleError::Format { found: 3, .. }), "{error}");
}

#[test]
fn other_ensembles_and_other_designs_are_rejected() {
    let dir = tempfile::tempdir().unwrap();
    let mut runs = runs(2);
    in_directory(dir.path()).run(&runs, &NAMES, 1, &simple, &(), &NEVER).unwrap();

    let error = Ensemble::open(dir.path(), "mesh = cylinder\nload = 0.1 mm").unwrap_err();
    assert!(matches!(error, EnsembleError::Foreign { .. }));
    let message = error.to_string();
    assert!(message.contains("stored: `load = 0.22 mm`; requested: `load = 0.1 mm`"), "{message}");
    assert!(!message.contains("cylinder"), "{message}");

    let ensemble = in_directory(dir.path());
    let refused = |runs: &[RunInput], names: &[&str]| {
        ensemble.run(runs, names, 1, &never_called, &(), &NEVER).unwrap_err()
    };
    runs[1].inputs[1] = 0.2;
    let error = refused(&runs, &NAMES);
    assert!(matches!(error, EnsembleError::OtherInputs { id: 2, .. }));
    let message = error.to_string();
    assert!(
        message.contains("viscosity_mpa_s = 0.1,") && message.contains("viscosity_mpa_s = 0.2")
    );
    runs[1].inputs[1] = f64::INFINITY;
    assert!(refused(&runs, &NAMES).to_string().contains("viscosity_mpa_s = inf"));
    runs[1] = runs[0].clone();
    assert!(refused(&runs, &NAMES).to_string().contains("two runs have this number"));
    assert!(refused(&runs[..1], &NAMES[..1]).to_string().contains("2 inputs for 1 names"));

    fs::write(dir.path().join("ensemble.json"), "{\"format\": 1,").unwrap();
    let error = Ensemble::open(dir.path(), FINGERPRINT).unwrap_err();
    assert!(matches!(error, EnsembleError::Manifest { .. }), "{error}");
    let file = dir.path().join("run-000001.json");
    assert!(matches!(Ensemble::open(file, FINGERPRINT).unwrap_err(), EnsembleError::Io { .. }));
}

// The following tests need several processes: they start this test program again and run only the test `child`.

const CHILD_RUNS: usize = 16;

#[test]
#[ignore = "runs only in the processes that other tests start"]
fn child() {
    let Some(directory) = std::env::var_os(CHILD_DIRECTORY) else { return };
    let directory = PathBuf::from(directory);
    let log = directory.join("log.txt");
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        std::thread::sleep(Duration::from_millis(40));
        let mut log = OpenOptions::new().create(true).append(true).open(&log).unwrap();
        log.write_all(format!("{} {}\n", run.id, std::process::id()).as_bytes()).unwrap();
        simple(run, done)
    };
    let ensemble = in_directory(&directory.join("runs"));
    ensemble.run(&runs(CHILD_RUNS), &NAMES, 2, &job, &(), &NEVER).unwrap();
}

fn start_child(directory: &Path) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "ensemble::child", "--ignored"])
        .env(CHILD_DIRECTORY, directory)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Returns the numbers of the runs whose files exist.
fn on_disk(directory: &Path) -> BTreeSet<usize> {
    let name =
        |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let number = |name: String| name.strip_prefix("run-")?.strip_suffix(".json")?.parse().ok();
    match fs::read_dir(directory) {
        Ok(entries) => entries.map(name).filter_map(number).collect(),
        Err(_) => BTreeSet::new(),
    }
}

/// Returns the run number and the process number of each line of the log.
fn log(directory: &Path) -> Vec<(usize, u32)> {
    let text = fs::read_to_string(directory.join("log.txt")).unwrap();
    text.lines()
        .map(|line| {
            let (id, process) = line.split_once(' ').unwrap();
            (id.parse().unwrap(), process.parse().unwrap())
        })
        .collect()
}

#[test]
fn a_killed_process_loses_no_finished_run() {
    let dir = tempfile::tempdir().unwrap();
    let directory = dir.path().join("runs");
    // the process is killed twice, the second time while it resumes the ensemble
    for finished in [4, 9] {
        let mut child = start_child(dir.path());
        let patience = Instant::now();
        while on_disk(&directory).len() < finished {
            assert!(patience.elapsed() < Duration::from_secs(120), "the child does nothing");
            assert!(child.try_wait().unwrap().is_none(), "the child ended before it was killed");
            std::thread::sleep(Duration::from_millis(2));
        }
        // SIGKILL: neither destructors nor signal handlers run
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let finished = on_disk(&directory);
    assert!((9..CHILD_RUNS).contains(&finished.len()), "{finished:?}");

    let made = Mutex::new(BTreeSet::new());
    let job = |run: &RunInput, done: &dyn Fn(f64)| {
        assert!(made.lock().unwrap().insert(run.id), "run {} is computed twice", run.id);
        simple(run, done)
    };
    let listener = Listener::default();
    let runs = runs(CHILD_RUNS);
    let records = in_directory(&directory).run(&runs, &NAMES, 2, &job, &listener, &NEVER).unwrap();
    let made = made.into_inner().unwrap();
    assert_eq!(listener.warnings.into_inner().unwrap(), Vec::<String>::new(), "no incomplete file");
    assert!(made.is_disjoint(&finished));
    assert_eq!(
        made.union(&finished).copied().collect::<Vec<_>>(),
        (1..=CHILD_RUNS).collect::<Vec<_>>()
    );

    // the records equal the records of an undisturbed ensemble
    let calm = tempfile::tempdir().unwrap();
    let undisturbed =
        in_directory(calm.path()).run(&runs, &NAMES, 1, &simple, &(), &NEVER).unwrap();
    assert_eq!(without_seconds(records), without_seconds(undisturbed));
    // a killed process loses only runs in progress: at most four runs, with two threads and two kills
    let repeated = log(dir.path()).iter().filter(|(id, _)| made.contains(id)).count();
    assert!(repeated <= 4, "{repeated} runs were finished but not stored");
}

#[test]
fn processes_that_share_a_directory_compute_every_run_once() {
    let dir = tempfile::tempdir().unwrap();
    let mut children = [start_child(dir.path()), start_child(dir.path())];
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    let log = log(dir.path());
    let mut made: Vec<usize> = log.iter().map(|&(id, _)| id).collect();
    made.sort_unstable();
    assert_eq!(made, (1..=CHILD_RUNS).collect::<Vec<_>>());
    assert_eq!(on_disk(&dir.path().join("runs")).len(), CHILD_RUNS);
}
