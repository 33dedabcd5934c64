//! Runs one simulation on several processes by `mpirun`.
//!
//! The tests need a program that is built with the feature `mpi`, and an MPI library (`.ci/run` installs Open MPI if
//! possible). Otherwise they print that they were skipped. `fem/tests/ranks` tests everything except the calls of MPI
//! on any machine, with threads instead of processes.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A specimen with some hundred vertices that breaks.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.1
order = 2
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[phase_field]
length_mm = 0.06
[solver]
linear = "multigrid"
[test]
displacement_mm = 0.22
steps = 40
stop_below_peak = 0.2
[output]
fields_every = 10
checkpoint_every = 5
"#;

const PROGRAM: &str = env!("CARGO_BIN_EXE_breccia");

/// A folder with the case; `None` if there is no MPI.
fn folder() -> Option<tempfile::TempDir> {
    if cfg!(not(feature = "mpi")) {
        println!("SKIPPED: this program is built without the feature mpi");
        return None;
    }
    if Command::new("mpirun").arg("--version").output().is_err() {
        println!("SKIPPED: there is no mpirun");
        return None;
    }
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("case.toml"), CASE).expect("a case");
    Some(folder)
}

/// Command that starts `processes` processes on this machine, for any number of cores and any user, including root.
fn mpirun(folder: &Path, processes: &str, arguments: &[&str]) -> Command {
    let mut command = Command::new("mpirun");
    command
        .args(["-n", processes, PROGRAM])
        .args(arguments)
        .current_dir(folder)
        .envs(["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"].map(|name| (name, "1")))
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
        .env("OMPI_MCA_mpi_yield_when_idle", "1")
        .env("RAYON_NUM_THREADS", "1");
    command
}

fn alone(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(PROGRAM).args(arguments).current_dir(folder).output().expect("a program")
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The columns of a curve file.
fn columns(path: &Path) -> Vec<Vec<f64>> {
    let file = std::fs::read_to_string(path).expect("a curve");
    let row = |line: &str| line.split(',').map(|x| x.parse().expect("a number")).collect();
    file.lines().skip(1).map(row).collect()
}

/// Asserts that two curves agree to the solver's tolerance; returns the Newton iterations of both runs.
fn assert_same(one: &Path, other: &Path) -> [f64; 2] {
    let (one, other) = (columns(one), columns(other));
    assert_eq!(one.len(), other.len());
    let highest = one.iter().map(|row| row[2]).fold(0.0, f64::max);
    assert!(one.last().expect("a row")[2] < 0.8 * highest, "it is past its peak");
    for (a, b) in one.iter().zip(&other) {
        assert!((a[1] - b[1]).abs() < 1e-9 && (a[2] - b[2]).abs() < 1e-6 * highest, "{a:?} {b:?}");
    }
    let newton = |rows: &[Vec<f64>]| rows.iter().map(|row| row[NEWTON]).sum();
    [newton(&one), newton(&other)]
}

/// Index of the column of Newton iterations.
const NEWTON: usize = 8;

#[test]
fn two_processes_give_the_curve_and_the_files_of_one() {
    let Some(folder) = folder() else { return };
    let folder = folder.path();
    let one = alone(folder, &["simulate", "case.toml", "--out", "one"]);
    assert!(one.status.success(), "{}", text(&one));
    let two = mpirun(folder, "2", &["simulate", "case.toml", "--out", "two"]).output().unwrap();
    assert!(two.status.success(), "{}", text(&two));
    assert_eq!(String::from_utf8_lossy(&two.stdout).trim(), "two/curve.csv");
    let [a, b] = assert_same(&folder.join("one/curve.csv"), &folder.join("two/curve.csv"));
    // linear systems are solved to a relative residual of 0.01, so that rounding errors may change the number of
    // iterations
    assert!((a - b).abs() <= a / 40.0, "{a} and {b} Newton iterations");
    for name in ["fields/step-00010.vtu", "fields.pvd"] {
        let length = |out: &str| std::fs::metadata(folder.join(out).join(name)).expect(name).len();
        let (one, two) = (length("one"), length("two"));
        assert!(one.abs_diff(two) < one / 10, "{name}: {one} and {two} bytes");
    }
    let whole = mpirun(folder, "2", &["run", "case.toml"]).output().unwrap();
    assert!(
        !whole.status.success()
            && text(&whole).contains("only `simulate` can run on several processes"),
        "{}",
        text(&whole)
    );
    let wrong = mpirun(folder, "2", &["simulate", "gone.toml"]).output().unwrap();
    assert!(!wrong.status.success() && text(&wrong).contains("gone.toml"), "{}", text(&wrong));
}

#[cfg(target_os = "linux")]
#[test]
fn a_process_that_dies_ends_the_run_with_its_state_named_and_one_goes_on() {
    let Some(folder) = folder() else { return };
    let folder = folder.path();
    let mut command = mpirun(folder, "2", &["simulate", "case.toml", "--out", "out"]);
    let mut run = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("mpirun");
    let state = folder.join("out/simulate.state");
    while !state.is_file() && run.try_wait().expect("a process").is_none() {
        std::thread::yield_now();
    }
    let ranks = children(run.id());
    assert_eq!(ranks.len(), 2, "{ranks:?}");
    let killed = Command::new("kill").args(["-9", &ranks[1].to_string()]).status();
    assert!(killed.expect("kill").success());
    let ended = run.wait_with_output().expect("an end");
    let said = text(&ended);
    assert!(!ended.status.success() && said.contains("resumes from out/simulate.state"), "{said}");
    let again = alone(folder, &["simulate", "case.toml", "--out", "out"]);
    assert!(again.status.success() && text(&again).contains("resumes after step"), "{said}");
    let whole = alone(folder, &["simulate", "case.toml", "--out", "one"]);
    assert!(whole.status.success(), "{}", text(&whole));
    assert_same(&folder.join("one/curve.csv"), &folder.join("out/curve.csv"));
}

/// Child processes of a process, in the order of their ids.
#[cfg(target_os = "linux")]
fn children(parent: u32) -> Vec<u32> {
    let parent_of = |id: u32| -> Option<u32> {
        let stat = std::fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()
    };
    let all = std::fs::read_dir("/proc").expect("processes").filter_map(Result::ok);
    let ids = all.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    let mut ids: Vec<u32> = ids.filter(|&id| parent_of(id) == Some(parent)).collect();
    ids.sort_unstable();
    ids
}

/// Copies of a program without the feature `mpi` would all run the same simulation, so that they are refused.
#[cfg(not(feature = "mpi"))]
#[test]
fn a_program_without_mpi_refuses_to_be_one_of_several() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("case.toml"), CASE).expect("a case");
    let output = Command::new(PROGRAM)
        .args(["simulate", "case.toml"])
        .current_dir(folder.path())
        .env("OMPI_COMM_WORLD_SIZE", "4")
        .output()
        .expect("a program");
    let said = text(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(said.contains("4 processes") && said.contains("--features mpi"), "{said}");
}
