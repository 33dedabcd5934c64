//! Runs of a program that fail, hang, are interrupted or killed.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::super::{breccia, start, table, without_seconds};
use super::{CASE, SOLVER, check_posterior, folder, run, solved, work};

/// Runs that fail, hang or write nothing useful are recorded with their reasons, and the calibration uses all other
/// runs. If the limits change, only the failed runs are repeated.
#[test]
fn failing_and_hanging_runs_are_left_out_and_tried_again_under_other_limits() {
    let bad = "case $2 in 3) echo 'no convergence in step 7'; exit 3;; 4) sleep 60;; 5) exit 0;; \
               6) echo extension_mm > result.csv; exit;; 7) echo strain > result.csv; echo 1 >> result.csv; exit;; esac\n";
    let trouble = format!("{bad}{SOLVER}").replace("case", "echo try >> \"$MARKS/tries-$2\"\ncase");
    let case = CASE
        .replace("files", "time_limit_s = 1.5\nretries = 1\nfiles")
        .replace("runs = 10", "runs = 14");
    let dir = folder(&case, &trouble);
    let begin = Instant::now();
    let (_, err) = run(dir.path(), &["--threads", "2"]);
    assert!(begin.elapsed() < Duration::from_secs(40), "the hanging run was not stopped");
    assert!(err.contains("5 of 14 runs have no quantities"), "{err}");
    let results = dir.path().join("results");
    let failed = std::fs::read_to_string(results.join("failed_runs.csv")).unwrap();
    for part in [
        "exit status: 3; its last line: no convergence in step 7",
        "stopped at the time limit of 1.5 s",
        "has not written result.csv",
        "0 lines of values",
        "there is no extension_mm among the results strain",
        "(2 attempts of at most 1.5 s)",
        "run-003-2",
    ] {
        assert!(failed.contains(part), "{part}: {failed}");
    }
    let of = |file: &str| -> Vec<String> {
        table(&results.join(file)).into_iter().map(|row| row["run"].clone()).collect()
    };
    assert_eq!(of("runs.csv"), ["1", "2", "8", "9", "10", "11", "12", "13", "14"]);
    let tries = |run: usize| {
        let text = std::fs::read_to_string(dir.path().join(format!("marks/tries-{run}"))).unwrap();
        text.lines().count()
    };
    assert_eq!([3, 4, 5].map(tries), [2, 2, 2]);
    assert_eq!([8, 14].map(tries), [1, 1]);
    let warnings = std::fs::read_to_string(results.join("warnings.txt")).unwrap();
    assert!(warnings.contains("5 of 14 runs"), "{warnings}");
    // more than a tenth of the runs are missing
    let summary = std::fs::read_to_string(results.join("summary.txt")).unwrap();
    assert!(summary.contains("identified with missing runs"), "{summary}");
    check_posterior(&results);

    // with a longer limit and one attempt, the failed runs are made once more, and no other run
    let longer = case.replace("time_limit_s = 1.5\nretries = 1", "time_limit_s = 2.0");
    std::fs::write(dir.path().join("bar.toml"), longer).unwrap();
    run(dir.path(), &["--threads", "2"]);
    assert_eq!([3, 4, 5].map(tries), [3, 3, 3]);
    assert_eq!([8, 14].map(tries), [1, 1]);
    run(dir.path(), &["--threads", "2"]);
    assert_eq!([3, 4, 5].map(tries), [3, 3, 3]);
}

/// If too few runs succeed, the error names their number, the reason and the remedy.
#[test]
fn an_ensemble_without_usable_runs_ends_with_the_reason() {
    let failing = "if [ \"$2\" -gt 1 ]; then echo 'no convergence in step 7'; exit 3; fi\n";
    let dir = folder(CASE, &format!("{failing}{SOLVER}"));
    let (code, _, err) = breccia(dir.path(), &["run", "bar.toml", "--out", "results"]);
    assert_eq!(code, Some(1), "{err}");
    for part in [
        "9 of 10 runs have no quantities",
        "at least 2 runs",
        "exit status: 3",
        "no convergence in step 7",
        "[simulator]",
    ] {
        assert!(err.contains(part), "{part}: {err}");
    }
}

fn wait_for(what: &str, condition: impl Fn() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn records(dir: &Path) -> usize {
    let folders = std::fs::read_dir(dir.join("results/ensemble"));
    let files = folders.into_iter().flatten().flat_map(|entry| {
        std::fs::read_dir(entry.unwrap().path()).into_iter().flatten().map(|file| file.unwrap())
    });
    let is_record = |name: &str| name.starts_with("run-") && name.ends_with(".json");
    files.filter(|file| is_record(&file.file_name().to_string_lossy())).count()
}

/// An interrupted and a killed run resume with the finished runs, and end with the results of an uninterrupted run. An
/// interrupt stops the program; files that are not of Breccia stay.
#[test]
#[cfg(unix)]
fn interrupted_and_killed_ensembles_resume() {
    let slow = format!("echo $$ > \"$MARKS/pid-$2\"\nsleep 0.3\n{SOLVER}");
    let dir = folder(CASE, &slow);
    let arguments = ["run", "bar.toml", "--out", "results", "--threads", "1"];
    let mut killed = start(dir.path(), &arguments);
    wait_for("two runs end", || records(dir.path()) >= 2);
    killed.kill().unwrap();
    killed.wait().unwrap();
    let of_user = work(dir.path())[0].join("notes.txt");
    std::fs::write(&of_user, "mine").unwrap();
    let (code, status, _) = breccia(dir.path(), &["status", "results"]);
    assert_eq!(code, Some(3), "{status}");

    let mut interrupted = start(dir.path(), &arguments);
    wait_for("four runs end", || records(dir.path()) >= 4);
    let pid = interrupted.id().to_string();
    Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert_ne!(interrupted.wait().unwrap().code(), Some(0));
    let pids = (1..=10).filter_map(|run| {
        std::fs::read_to_string(dir.path().join(format!("marks/pid-{run}"))).ok()
    });
    for pid in pids {
        let alive = Command::new("kill").args(["-0", pid.trim()]).stderr(Stdio::null()).status();
        assert!(!alive.unwrap().success(), "process {pid} goes on after the interrupt");
    }
    let finished: BTreeSet<usize> = (1..=4).filter(|&run| solved(dir.path(), run) > 0).collect();
    assert_eq!(finished.len(), 4);
    run(dir.path(), &["--threads", "2"]);
    // the killed and the interrupted process may have begun runs 3 and 5; confirming runs have the numbers 1 and 2
    assert_eq!([1, 2, 4].map(|run| solved(dir.path(), run)), [2, 2, 1]);
    assert_eq!(std::fs::read_to_string(of_user).unwrap(), "mine");

    let whole = folder(CASE, SOLVER);
    run(whole.path(), &[]);
    let [own, other] = [dir.path(), whole.path()].map(|dir| dir.join("results"));
    assert_eq!(without_seconds(&own.join("runs.csv")), without_seconds(&other.join("runs.csv")));
    let text = |results: &Path| std::fs::read_to_string(results.join("summary.csv")).unwrap();
    assert_eq!(text(&own), text(&other));
}

/// A program that cannot solve any run is not tried at all points of the design.
#[test]
fn a_program_that_fails_in_all_of_its_first_runs_ends_the_ensemble() {
    let case = CASE.replace("files", "retries = 1\nfiles");
    let dir = folder(&case, "echo try >> \"$MARKS/tries\"\necho 'no licence'\nexit 2\n");
    let arguments = ["run", "bar.toml", "--out", "results", "--threads", "1"];
    let (code, _, err) = breccia(dir.path(), &arguments);
    assert_eq!(code, Some(1), "{err}");
    for part in [
        "error: bar.toml: simulator.command: ",
        "all of the first 5 runs have failed",
        "no licence",
        "work/run-00",
    ] {
        assert!(err.contains(part), "{part:?} is not in {err}");
    }
    assert!(!err.contains("results/case.toml"), "{err}");
    let tries = std::fs::read_to_string(dir.path().join("marks/tries")).unwrap();
    assert_eq!(tries.lines().count(), 10, "two attempts for each of five of the ten runs");
}
