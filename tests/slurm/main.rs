//! An ensemble as jobs of a real Slurm, which these tests start on this machine.
//!
//! The tests need root and Debian's packages slurm-wlm and munge (`.ci/run` installs them if possible), or an existing
//! cluster (SLURM_CONF and sbatch). Otherwise they print that they were skipped.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant, SystemTime};

/// 34 simulations of a tenth of a second each.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.0
order = 1
grains = { fraction = 0.05, seed = 1, film_mm = 0.5, form = "sphere" }
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[material.grain]
young_mpa = 22000.0
poisson = 0.25
[phase_field]
length_mm = 0.06
[test]
displacement_mm = 0.22
steps = 44
stop_below_peak = 0.1
[prior]
matrix.young_mpa = [250.0, 300.0]
matrix.toughness_n_per_mm = [0.00001, 0.005]
matrix.viscosity_mpa_s = [0.05, 0.55]
[design]
runs = 30
[fidelity]
levels = [{ spacing_mm = 1.25, repeats = 4 }]
"#;

/// A Slurm cluster on this machine, which is stopped when this value is dropped.
struct Cluster {
    folder: tempfile::TempDir,
    conf: String,
}

impl Cluster {
    /// Starts a cluster; the error states why this is not possible.
    fn start() -> Result<Self, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        let output = script(folder.path(), "start").map_err(|e| e.to_string())?;
        let told = String::from_utf8_lossy(&output.stdout);
        match told.lines().find_map(|line| line.strip_prefix("export SLURM_CONF=")) {
            Some(conf) if output.status.success() => Ok(Self { conf: conf.to_owned(), folder }),
            _ => Err(String::from_utf8_lossy(&output.stderr).trim().to_owned()),
        }
    }

    fn command(&self, program: &str, folder: &Path) -> Command {
        let mut command = Command::new(program);
        command.current_dir(folder).env("SLURM_CONF", &self.conf);
        // this test may run in a job of Slurm: remove the variables of this job, which the commands
        // would inherit
        for (name, _) in std::env::vars() {
            if name.starts_with("SLURM_") && name != "SLURM_CONF" {
                command.env_remove(name);
            }
        }
        command
    }

    fn output(&self, program: &str, folder: &Path, arguments: &[&str]) -> Output {
        let output = self.command(program, folder).args(arguments).output();
        output.unwrap_or_else(|e| panic!("{program}: {e}"))
    }

    /// Lines of squeue, one per task or job.
    fn queue(&self) -> Vec<String> {
        let output = self.output("squeue", Path::new("/"), &["-h", "-r", "-o", "%i %t"]);
        String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
    }

    fn wait_until_idle(&self) {
        wait_for("the queue to be empty", || {
            let is_empty = self.queue().is_empty();
            // pause, because each query of the queue starts two processes for some milliseconds
            std::thread::sleep(Duration::from_millis(if is_empty { 0 } else { 200 }));
            is_empty
        });
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = script(self.folder.path(), "stop");
    }
}

fn script(root: &Path, what: &str) -> std::io::Result<Output> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/slurm/start-slurm.sh");
    Command::new("bash").arg(script).arg(what).env("SLURM_TEST_ROOT", root).output()
}

fn breccia(cluster: &Cluster, folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = cluster.output(env!("CARGO_BIN_EXE_breccia"), folder, arguments);
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

fn wait_for(what: &str, mut holds: impl FnMut() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(300);
    while !holds() {
        assert!(Instant::now() < deadline, "waiting in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Files of finished runs with their time stamps.
fn finished(results: &Path) -> BTreeMap<PathBuf, SystemTime> {
    let entries = |path: &Path| std::fs::read_dir(path).into_iter().flatten().flatten();
    entries(&results.join("ensemble"))
        .flat_map(|ensemble| entries(&ensemble.path()).collect::<Vec<_>>())
        .filter(|e| e.file_name().to_string_lossy().starts_with("run-"))
        .filter_map(|e| Some((e.path(), e.metadata().ok()?.modified().ok()?)))
        .collect()
}

/// The table of the runs without its column of times.
fn runs(results: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(results.join("runs.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let seconds = header.iter().position(|column| *column == "seconds").unwrap();
    let cells = |line: &str| {
        let cells = line.split(',').enumerate().filter(|(at, _)| *at != seconds);
        cells.map(|(_, cell)| cell.to_owned()).collect()
    };
    lines.map(cells).collect()
}

/// Output of all jobs.
fn logs(results: &Path) -> String {
    let logs = std::fs::read_dir(results.join("slurm")).into_iter().flatten().flatten();
    logs.filter(|e| e.path().extension().is_some_and(|x| x == "log"))
        .map(|e| format!("{}:\n{}", e.path().display(), std::fs::read_to_string(e.path()).unwrap()))
        .collect()
}

#[test]
fn jobs_make_what_one_process_would_whatever_happens_to_them() {
    let cluster = match Cluster::start() {
        Ok(cluster) => cluster,
        Err(why) => {
            // written to standard error directly, because the test harness hides the output of a passing test
            let note = format!("SKIPPED: no Slurm can be started here ({why})");
            writeln!(std::io::stderr(), "{note}").expect("stderr is open");
            return;
        }
    };
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path();
    std::fs::write(folder.join("case.toml"), CASE).unwrap();
    let (code, _, err) = breccia(&cluster, folder, &["ensemble", "case.toml", "--out", "alone"]);
    assert_eq!(code, Some(0), "{err}");
    let expected = runs(&folder.join("alone"));
    assert_eq!(expected.len(), 30);

    submitted_by_the_program(&cluster, folder, &expected);
    submitted_by_hand(&cluster, folder, &expected);
    refused(&cluster, folder);
    own_program(&cluster, folder);
    a_whole_study(&cluster, folder);
}

/// Tables that the case needs in addition for a calibration.
const CALIBRATED: &str = r#"
[surrogate]
max_order = 2
[experiments.virtual]
specimens = 3
seed = 11
truth = { matrix.young_mpa = 275.0, matrix.toughness_n_per_mm = 0.0025, matrix.viscosity_mpa_s = 0.3 }
[calibration]
chains = 2
warmup = 150
draws = 150
[confirm]
draws = 1
second_spacing_mm = 1.25
"#;
const STUDY: &str = r#"
title = "Two designs"
base = "whole.toml"
[[laboratory]]
name = "L"
[[case]]
name = "A"
laboratory = "L"
set.design = { runs = 12, microstructure = "one" }
without = ["fidelity"]
[[case]]
name = "B"
laboratory = "L"
set.design.runs = 10
without = ["fidelity"]
"#;

/// Submits a study: laboratory, meshes, runs and calibrations are jobs that wait for each other.
fn a_whole_study(cluster: &Cluster, folder: &Path) {
    std::fs::write(folder.join("whole.toml"), format!("{CASE}{CALIBRATED}")).unwrap();
    std::fs::write(folder.join("study.toml"), STUDY).unwrap();
    let submit = ["study", "study.toml", "--out", "on cluster", "--slurm", "--tasks", "2"];
    let (code, out, err) = breccia(cluster, folder, &submit);
    assert_eq!(code, Some(0), "{err}");
    for part in [
        "study.sbatch",
        "laboratories/L: specimens",
        "A: mesh",
        "A: runs",
        "B: calibration",
        "the comparison of all cases",
    ] {
        assert!(out.contains(part), "{part}: {out}");
    }
    let (code, told, _) = breccia(cluster, folder, &["status", "on cluster"]);
    assert!(code == Some(3) && told.contains("laboratories/L"), "{told}");
    // submitted again while jobs run: more jobs share the same folder
    let (code, _, err) = breccia(cluster, folder, &submit);
    assert_eq!(code, Some(0), "{err}");
    cluster.wait_until_idle();
    let results = folder.join("on cluster");
    let (code, told, _) = breccia(cluster, folder, &["status", "on cluster"]);
    assert_eq!(code, Some(0), "{told}\n{}", logs(&results));

    // the results of a single process, for comparison
    let (code, _, err) = breccia(cluster, folder, &["study", "study.toml", "--out", "in one"]);
    assert_eq!(code, Some(0), "{err}");
    let read = |name: &str| {
        let [jobs, alone] =
            ["on cluster", "in one"].map(|out| std::fs::read(folder.join(out).join(name)).unwrap());
        (jobs, alone)
    };
    for name in ["study.csv", "A/posterior.csv", "B/confirm.csv", "A/mesh.msh"] {
        let (jobs, alone) = read(name);
        assert!(jobs == alone, "{name}\n{}", logs(&results));
    }
    assert!(results.join("report.html").is_file());
    let (code, out, _) = breccia(cluster, folder, &submit);
    assert!(code == Some(0) && out.contains("nothing is submitted"), "{out}");
    let (code, _, err) =
        breccia(cluster, folder, &["study", "study.toml", "--out", "in one", "--only", "C"]);
    assert!(code == Some(1) && err.contains("is not a part of the study"), "{err}");
}

/// A case whose runs are made by a program of the user.
const OWN_PROGRAM: &str = r#"
[simulator]
command = ["sh", "bar.sh", "{k1}", "{run}"]
files = ["bar.sh"]
[parameters]
k1 = { unit = "MPa", prior = [1.0, 2.0] }
[qoi]
quantities = ["column:extension_mm"]
[design]
runs = 12
"#;

/// The tasks of an array share the runs of a program of the user: each run is made once.
fn own_program(cluster: &Cluster, folder: &Path) {
    let folder = folder.join("own");
    std::fs::create_dir(&folder).unwrap();
    let marks = folder.join("marks");
    std::fs::create_dir(&marks).unwrap();
    let script = format!(
        "echo made >> '{}'/$2\nawk -v k=\"$1\" 'BEGIN {{ print \"extension_mm\"; print 3 * k }}' > result.csv\nsleep 0.2\n",
        marks.display()
    );
    std::fs::write(folder.join("bar.sh"), script).unwrap();
    std::fs::write(folder.join("bar.toml"), OWN_PROGRAM).unwrap();
    let submit = ["ensemble", "bar.toml", "--out", "jobs", "--slurm", "--tasks", "2"];
    let (code, out, err) = breccia(cluster, &folder, &submit);
    assert_eq!(code, Some(0), "{out}{err}");
    cluster.wait_until_idle();
    let results = folder.join("jobs");
    assert!(results.join("runs.csv").is_file(), "{}", logs(&results));
    assert_eq!(runs(&results).len(), 12);
    for run in 1..=12 {
        let made = std::fs::read_to_string(marks.join(run.to_string())).unwrap();
        assert_eq!(made, "made\n", "run {run}");
    }
}

/// Cancels one running task, requeues a second and kills a third.
fn submitted_by_the_program(cluster: &Cluster, folder: &Path, expected: &[Vec<String>]) {
    let submit = [
        "ensemble",
        "case.toml",
        "--out",
        "jobs",
        "--slurm",
        "--tasks",
        "3",
        "--time",
        "10:00",
        "--memory",
        "500M",
        "--partition",
        "main",
    ];
    let results = folder.join("jobs");
    let (code, out, err) = breccia(cluster, folder, &submit);
    assert_eq!(code, Some(0), "{err}");
    let job = out.lines().find_map(|line| line.strip_prefix("job ")?.split(':').next());
    let job = job.unwrap_or_else(|| panic!("no job number: {out}")).to_owned();
    assert!(out.contains("ensemble.sbatch") && out.contains("collects the runs"), "{out}");

    wait_for("three runs", || finished(&results).len() >= 3);
    let mut seen = finished(&results);
    let (code, told, _) = breccia(cluster, folder, &["status", "jobs"]);
    assert!(code == Some(3) && told.contains("of 34 runs"), "{told}");
    cluster.output("scancel", folder, &[&format!("{job}_0")]);
    cluster.output("scontrol", folder, &["requeue", &format!("{job}_1")]);
    // SIGKILL to one process of the array that still runs
    let list = Command::new("pgrep").args(["-f", &format!("--out {}", results.display())]).output();
    if let Some(pid) = list.ok().and_then(|output| {
        String::from_utf8_lossy(&output.stdout).lines().next().map(str::to_owned)
    }) {
        let _ = Command::new("kill").args(["-9", &pid]).status();
    }
    // submitted again while jobs run: more jobs share the same folder
    let (code, _, err) = breccia(cluster, folder, &submit);
    assert_eq!(code, Some(0), "{err}");
    while !cluster.queue().is_empty() {
        let now = finished(&results);
        assert!(seen.iter().all(|(run, time)| now.get(run) == Some(time)), "a run was made twice");
        seen = now;
        std::thread::sleep(Duration::from_millis(200));
    }
    assert!(results.join("runs.csv").is_file(), "{}", logs(&results));
    assert_eq!(runs(&results), expected, "{}", logs(&results));
    // including one run that is repeated with the other quadrature in the middle of the box
    assert_eq!(finished(&results).len(), 35);
    let (_, told, _) = breccia(cluster, folder, &["status", "jobs"]);
    assert!(told.contains("ensemble     done     34 of 34 runs"), "{told}");

    let before = finished(&results);
    let (code, out, err) = breccia(cluster, folder, &submit);
    assert!(code == Some(0) && out.contains("nothing is submitted"), "{out} {err}");
    assert!(cluster.queue().is_empty() && finished(&results) == before);
}

/// Submits the written script by sbatch.
fn submitted_by_hand(cluster: &Cluster, folder: &Path, expected: &[Vec<String>]) {
    let write = [
        "ensemble",
        "case.toml",
        "--out",
        "by hand",
        "--slurm-script",
        "jobs.sbatch",
        "--tasks",
        "2",
        "--sbatch=--comment=calibration",
    ];
    let (code, out, err) = breccia(cluster, folder, &write);
    assert!(code == Some(0) && out.contains("sbatch jobs.sbatch"), "{out} {err}");
    assert!(cluster.queue().is_empty(), "only written");
    let results = folder.join("by hand");
    for _ in 0..2 {
        let output = cluster.output("sbatch", folder, &["jobs.sbatch"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        cluster.wait_until_idle();
        assert!(results.join("runs.csv").is_file(), "{}", logs(&results));
        assert_eq!(runs(&results), expected, "{}", logs(&results));
    }
}

/// If Slurm refuses a job, its message is printed. Mistakes that would fail on the cluster are reported before
/// submission.
fn refused(cluster: &Cluster, folder: &Path) {
    let ensemble = ["ensemble", "case.toml", "--out", "refused", "--slurm"];
    let (code, _, err) =
        breccia(cluster, folder, &[&ensemble[..], &["--partition", "gone"]].concat());
    assert!(
        code == Some(1) && err.contains("sbatch refuses") && err.contains("partition"),
        "{err}"
    );
    let one = CASE.replace("[design]", "[design]\nmicrostructure = \"one\"");
    std::fs::write(folder.join("one.toml"), one).unwrap();
    let (code, _, err) =
        breccia(cluster, folder, &["ensemble", "one.toml", "--out", "one", "--slurm"]);
    assert!(code == Some(1) && err.contains("`breccia mesh` first"), "{err}");
    assert!(cluster.queue().is_empty());
}

#[test]
fn without_slurm_the_program_says_so() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), CASE).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(["ensemble", "case.toml", "--out", "out", "--slurm"])
        .current_dir(dir.path())
        .env("PATH", dir.path())
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(err.contains("sbatch cannot be started") && err.contains("--slurm-script"), "{err}");
}
