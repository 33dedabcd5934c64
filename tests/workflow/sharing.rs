//! Several processes share one folder of results: division of the runs, interruptions and failures, and `breccia
//! status`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

use super::{
    TINY, breccia, case_folder, copy_of_tiny, finished, finished_tiny, start, without_seconds,
};

/// Every file below a folder with its time stamp and content.
fn everything(dir: &Path) -> BTreeMap<PathBuf, (SystemTime, Vec<u8>)> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(dir).unwrap().flatten() {
        let path = entry.path();
        match path.is_dir() {
            true => found.extend(everything(&path)),
            false => {
                let stamp = entry.metadata().unwrap().modified().unwrap();
                let content = std::fs::read(&path).unwrap();
                found.insert(path, (stamp, content));
            }
        }
    }
    found
}

fn wait_for(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(300);
    while !holds() {
        assert!(Instant::now() < deadline, "waiting in vain for {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The lines of `breccia status` by stage, and its exit code.
fn status(folder: &Path, out: &str) -> (Option<i32>, BTreeMap<String, String>) {
    let (code, told, err) = breccia(folder, &["status", out]);
    assert_eq!(err, "");
    let line = |line: &str| {
        let (stage, rest) = line.split_once(' ').unwrap();
        (stage.to_owned(), rest.trim().to_owned())
    };
    (code, told.lines().map(line).collect())
}

#[test]
fn processes_that_share_an_ensemble_make_each_run_once_and_one_collects_them() {
    let dir = case_folder();
    let worker = ["ensemble", "tiny.toml", "--out", "shared", "--share", "--threads", "1"];
    let runs = dir.path().join("shared/ensemble");
    let mut seen = BTreeMap::new();
    let mut killed = start(dir.path(), &worker);
    wait_for("two runs", || finished(&runs).len() >= 2);
    let mut others: Vec<_> = (0..2).map(|_| start(dir.path(), &worker)).collect();
    // SIGKILL: another process makes the run of the killed process
    killed.kill().unwrap();
    killed.wait().unwrap();
    while others.iter_mut().any(|child| child.try_wait().unwrap().is_none()) {
        let now = finished(&runs);
        assert!(
            seen.iter().all(|(path, time)| now.get(path) == Some(time)),
            "a run was made twice"
        );
        seen = now;
        std::thread::sleep(Duration::from_millis(2));
    }
    for child in others {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!(finished(&runs).len(), 12);
    assert!(!dir.path().join("shared/runs.csv").exists(), "workers write nothing else");

    // two processes collect at once: one writes the table, the other uses it
    let collecting = [(); 2].map(|()| start(dir.path(), &["ensemble", "--out", "shared"]));
    for child in collecting {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let alone = finished_tiny().dir.path().join("results");
    let shared = dir.path().join("shared");
    assert_eq!(without_seconds(&alone.join("runs.csv")), without_seconds(&shared.join("runs.csv")));
    let now = finished(&runs);
    assert!(seen.iter().all(|(path, time)| now.get(path) == Some(time)), "a run was made twice");

    // if all runs have ended, the same command has nothing to do
    let (code, _, err) = breccia(dir.path(), &worker);
    assert!(code == Some(0) && err.contains("finished before"), "{err}");
}

#[test]
fn two_programs_in_one_folder_end_at_what_one_alone_would() {
    let dir = case_folder();
    let both = [(); 2].map(|()| start(dir.path(), &["run", "tiny.toml", "--out", "both"]));
    for child in both {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let (code, stages) = status(dir.path(), "both");
    assert_eq!(code, Some(0), "{stages:?}");
    let (both, one) = (dir.path().join("both"), finished_tiny().dir.path().join("results"));
    for name in ["mesh.msh", "experiments.csv", "surrogate.json", "posterior.csv", "map.csv"] {
        let [a, b] = [&both, &one].map(|out| std::fs::read(out.join(name)).unwrap());
        assert!(a == b, "{name} differs");
    }
}

#[test]
fn status_tells_what_is_done_stale_stopped_and_under_way_and_changes_nothing() {
    let dir = case_folder();
    let results = dir.path().join("out");
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    breccia(dir.path(), &["init", "--own-data", "own"]);
    for (folder, why) in [
        ("gone", "there is no such folder"),
        ("tiny.toml", "it is a file"),
        ("empty", "it has no case.toml"),
        ("own", "no stage has been run there"),
    ] {
        let (code, out, err) = breccia(dir.path(), &["status", folder]);
        assert!(code == Some(1) && out.is_empty(), "{out}");
        assert!(err.contains(folder) && err.contains(why) && err.contains("--out DIR"), "{err}");
    }

    // the status of a process that runs, and after it was killed
    let mut child =
        start(dir.path(), &["ensemble", "tiny.toml", "--out", "out", "--share", "--threads", "1"]);
    wait_for("a run that has ended", || !finished(&results.join("ensemble")).is_empty());
    wait_for("a run under way after another", || {
        let (code, stages) = status(dir.path(), "out");
        assert!(code == Some(3) && stages.len() == 11, "{stages:?}");
        assert!(child.try_wait().unwrap().is_none(), "too quick to be seen: {stages:?}");
        let line = &stages["ensemble"];
        line.starts_with("running") && line.contains("per hour") && line.contains("left")
    });
    child.kill().unwrap();
    child.wait().unwrap();

    // a report shows the present state and does not count as a product
    let (code, _, err) = breccia(dir.path(), &["report", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    let page = || std::fs::read_to_string(results.join("report.html")).unwrap();
    let ended = finished(&results.join("ensemble")).len();
    let curves = format!("{ended} simulated tests over the prior box");
    for part in [
        "Not finished",
        &curves,
        "<svg viewBox=",
        "Missing: segment, mesh, experiments, ensemble, surrogate, calibrate, confirm, validate, \
         verdict, next-test.",
    ] {
        assert!(page().contains(part), "{part}");
    }
    assert!(!page().contains("Calibrated parameters") && !page().contains("NaN"));
    let before = everything(&results);
    let (code, stages) = status(dir.path(), "out");
    assert_eq!((code, stages["report"].as_str()), (Some(3), "to do"));
    let made = finished(&results.join("ensemble")).len();
    let stopped = format!("stopped  {made} of 12 runs; no process computes them");
    assert_eq!((stages["ensemble"].as_str(), stages["surrogate"].as_str()), (&*stopped, "to do"));
    assert!(before == everything(&results), "looking has changed something");

    // the status of finished results
    let dir = copy_of_tiny();
    let results = dir.path().join("results");
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(!page.contains("Not finished") && page.contains("Calibrated parameters"));
    let before = everything(&results);
    let (code, stages) = status(dir.path(), "results");
    assert_eq!(code, Some(0), "{stages:?}");
    assert!(stages.values().all(|line| line.starts_with("done")), "{stages:?}");
    assert_eq!(stages["ensemble"], "done     12 of 12 runs");
    assert!(before == everything(&results), "looking has changed something");

    // stages after a stale stage are stale, too
    let case = results.join("case.toml");
    let text = std::fs::read_to_string(&case).unwrap();
    std::fs::write(&case, text.replace("max_order = 2", "max_order = 1")).unwrap();
    let (code, stages) = status(dir.path(), "results");
    assert_eq!(code, Some(3));
    assert_eq!(stages["surrogate"], "stale    surrogate has changed in the case");
    for stage in ["calibrate", "confirm", "report"] {
        assert!(stages[stage].starts_with("stale"), "{stages:?}");
    }
    for stage in ["segment", "mesh", "experiments", "ensemble"] {
        assert!(stages[stage].starts_with("done"), "{stages:?}");
    }
}

#[test]
fn damaged_and_foreign_runs_are_told_from_good_ones() {
    let dir = copy_of_tiny();
    let ensemble = ["ensemble", "tiny.toml", "--out", "results"];
    let runs = dir.path().join("results/ensemble");
    let before = finished(&runs);
    // the folder of the ensemble; other folders contain the runs of later stages
    let torn = before.keys().find(|path| path.ends_with("run-000003.json")).unwrap().clone();
    let folder = torn.parent().unwrap().to_owned();
    let table = std::fs::read(dir.path().join("results/runs.csv")).unwrap();

    // only the run whose file is incomplete is made again
    let text = std::fs::read_to_string(&torn).unwrap();
    std::fs::write(&torn, &text[..text.len() / 2]).unwrap();
    std::fs::remove_file(dir.path().join("results/runs.csv")).unwrap();
    let (code, stages) = status(dir.path(), "results");
    assert!(code == Some(3) && stages["ensemble"].contains("1 damaged"), "{stages:?}");
    let (code, _, err) = breccia(dir.path(), &ensemble);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("run-000003.json is damaged") && err.contains("computed again"), "{err}");
    let now = finished(&runs);
    let changed: Vec<_> = before.iter().filter(|(path, time)| now[*path] != **time).collect();
    assert!(changed.len() == 1 && *changed[0].0 == torn, "{changed:?}");
    let rows = |bytes: &[u8]| String::from_utf8_lossy(bytes).lines().count();
    assert_eq!(rows(&std::fs::read(dir.path().join("results/runs.csv")).unwrap()), rows(&table));

    // runs by another version are neither used nor removed
    let manifest = folder.join("ensemble.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    let own = concat!("breccia ", env!("CARGO_PKG_VERSION"));
    assert!(text.contains(own), "{text}");
    std::fs::write(&manifest, text.replace(own, "breccia 0.0.9")).unwrap();
    std::fs::remove_file(dir.path().join("results/runs.csv")).unwrap();
    let all = finished(&runs);
    for sharing in [&[][..], &["--share"], &["--slurm-script", "script.sh"]] {
        let (code, _, err) = breccia(dir.path(), &[&ensemble, sharing].concat());
        assert_eq!(code, Some(1), "{err}");
        for part in ["another version", "breccia 0.0.9", own, "--out", "delete this folder"] {
            assert!(err.contains(part), "{part} is not in {err}");
        }
    }
    assert_eq!(finished(&runs), all);
}

/// A limit of the file size simulates a full disk: the system refuses to write in the middle of a file.
#[cfg(unix)]
#[test]
fn what_cannot_be_written_is_told_and_what_was_finished_is_kept() {
    let dir = tempfile::tempdir().unwrap();
    // the files of the first runs are smaller than the limit; files with longer curves exceed the limit
    std::fs::write(dir.path().join("tiny.toml"), TINY).unwrap();
    let program = env!("CARGO_BIN_EXE_breccia");
    let limited = format!(
        "trap '' XFSZ; ulimit -f 8; exec '{program}' ensemble tiny.toml --out out --threads 2"
    );
    let output = Command::new("bash")
        .args(["-c", &limited])
        .current_dir(dir.path())
        .stdin(Stdio::null())
        .output()
        .expect("bash is there");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    for part in ["cannot write", "run-0000", "free disk space", "resume"] {
        assert!(err.contains(part), "{part} is not in {err}");
    }
    // no incomplete file has the name of a complete file
    let kept = finished(&dir.path().join("out/ensemble"));
    for path in kept.keys() {
        let text = std::fs::read_to_string(path).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap();
    }
    assert!(!dir.path().join("out/runs.csv").exists());
    let (code, _, err) = breccia(dir.path(), &["ensemble", "tiny.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(!err.contains("damaged"), "{err}");
    let now = finished(&dir.path().join("out/ensemble"));
    // the 12 runs of the design, and one additional run with the other quadrature
    assert!(now.len() == 12 + 1 && kept.iter().all(|(path, time)| now[path] == *time));
}
