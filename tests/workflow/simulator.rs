//! A program of the user as the source of runs (`[simulator]`), and imported runs (`design.import`): posterior against
//! numerical integration, failures, time limits, interruption, resume.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{breccia, number, start, table, without_seconds};

/// The extension of a bar, 3 mm for `k1` = 1, is proportional to `k1`.
const SOLVER: &str = r#"
k1=$(sed -n 's/^k1 = //p' "$1")
echo "k1 = $k1 is solved"
echo solved >> "$MARKS/$2"
awk -v k="$k1" 'BEGIN { print "extension_mm"; printf "%.17g\n", 3 * k }' > result.csv
"#;

/// Measured extensions, mm.
const MEASURED: [f64; 6] = [4.4, 4.9, 4.3, 4.6, 4.75, 4.2];

const CASE: &str = r#"
[simulator]
command = ["sh", "solver.sh", "{input}", "{run}"]
input = "bar.txt"
files = ["solver.sh"]
[parameters]
k1 = { unit = "MPa", prior = [1.0, 2.0] }
[qoi]
quantities = ["column:extension_mm"]
[design]
runs = 10
[surrogate]
max_order = 2
[experiments]
values = "measured.csv"
[calibration]
chains = 2
warmup = 500
draws = 2000
[confirm]
draws = 1
"#;

/// A folder with the case, the template of its input file, the program and the measured quantities.
fn folder(case: &str, solver: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("bar.toml", case);
    write("bar.txt", "# {{k1}} in MPa\nk1 = {k1}\n");
    std::fs::create_dir(dir.path().join("marks")).unwrap();
    let marks = dir.path().join("marks");
    write("solver.sh", &format!("MARKS='{}'\n{solver}", marks.display()));
    let rows: String = MEASURED.iter().enumerate().map(|(i, u)| format!("B-{i},{u:?}\n")).collect();
    write("measured.csv", &format!("id,extension_mm\n{rows}"));
    dir
}

fn run(dir: &Path, arguments: &[&str]) -> (String, String) {
    let (code, out, err) =
        breccia(dir, &[&["run", "bar.toml", "--out", "results"], arguments].concat());
    assert_eq!(code, Some(0), "{err}");
    (out, err)
}

/// Number of times that the program has solved a run.
fn solved(dir: &Path, run: usize) -> usize {
    let text = std::fs::read_to_string(dir.join("marks").join(run.to_string()));
    text.map_or(0, |text| text.lines().count())
}

/// Folders in which the program has worked for the runs of the design.
fn work(dir: &Path) -> Vec<PathBuf> {
    let ensemble = std::fs::read_dir(dir.join("results/ensemble")).unwrap();
    let all = ensemble.flat_map(|entry| {
        let work = entry.unwrap().path().join("work");
        std::fs::read_dir(work).into_iter().flatten().map(|entry| entry.unwrap().path())
    });
    let mut all: Vec<PathBuf> = all.collect();
    all.sort();
    all
}

/// Mean and standard deviation of the posterior of `k1`, by a sum over a grid of `k1` and of the scatter s: the specimens
/// yᵢ have the density N(yᵢ/ȳ; 3 k1/ȳ, s), k1 is uniform, and s has the prior Normal(0.15, 0.25), s > 0.
fn exact() -> [f64; 2] {
    let mean = MEASURED.iter().sum::<f64>() / MEASURED.len() as f64;
    let [mut total, mut first, mut second] = [0.0; 3];
    let steps = 2000;
    for i in 0..steps {
        let k1 = 1.0 + (f64::from(i) + 0.5) / f64::from(steps);
        for j in 0..steps {
            let s = 0.6 * (f64::from(j) + 0.5) / f64::from(steps);
            let squares: f64 = MEASURED.iter().map(|y| ((y - 3.0 * k1) / mean).powi(2)).sum();
            let ln = -0.5 * squares / (s * s)
                - MEASURED.len() as f64 * s.ln()
                - 0.5 * ((s - 0.15) / 0.25).powi(2);
            let weight = ln.exp();
            total += weight;
            first += weight * k1;
            second += weight * k1 * k1;
        }
    }
    let mean = first / total;
    [mean, (second / total - mean * mean).sqrt()]
}

fn row_of(
    results: &Path,
    file: &str,
    parameter: &str,
) -> std::collections::BTreeMap<String, String> {
    table(&results.join(file)).into_iter().find(|row| row["parameter"] == parameter).unwrap()
}

#[test]
fn a_program_is_calibrated_and_its_posterior_is_the_exact_one() {
    let dir = folder(CASE, SOLVER);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    for part in ["sh solver.sh {input} {run}", "k1: ", "6 readable in", "12 simulations"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    let (out, err) = run(dir.path(), &["--threads", "2"]);
    assert!(out.contains("k1"), "{out}{err}");
    let results = dir.path().join("results");
    let runs = table(&results.join("runs.csv"));
    assert_eq!(runs.len(), 10);
    for row in &runs {
        assert!((number(row, "extension_mm") - 3.0 * number(row, "k1")).abs() < 1e-12, "{row:?}");
    }
    let summary = row_of(&results, "summary.csv", "k1");
    let [mean, sd] = exact();
    let error = sd / number(&summary, "ess_bulk").sqrt();
    assert!((number(&summary, "mean") - mean).abs() < 4.0 * error, "{summary:?} {mean} ± {error}");
    // the standard error of a standard deviation, for tails that are a little heavier than normal ones
    assert!((number(&summary, "sd") / sd - 1.0).abs() < 4.0 * error / sd, "{summary:?} {sd}");
    assert_eq!(row_of(&results, "verdict.csv", "k1")["verdict"], "identified");
    let confirm = table(&results.join("confirm.csv"));
    let map = number(&row_of(&results, "map.csv", "k1"), "map");
    assert!((number(&confirm[0], "map_simulation") - 3.0 * map).abs() < 1e-9, "{confirm:?}");

    // each run has a folder with its files and what the program has printed
    let folders = work(dir.path());
    assert_eq!(folders.len(), 10);
    let text = |name: &str| std::fs::read_to_string(folders[6].join(name)).unwrap();
    let k1 = &runs[6]["k1"];
    assert_eq!(text("bar.txt"), format!("# {{k1}} in MPa\nk1 = {k1}\n"));
    assert_eq!(text("program-output.txt"), format!("k1 = {k1} is solved\n"));
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in ["k1 (MPa)", "extension_mm", "Confirming simulation", "with the program sh.", "B-3"]
    {
        assert!(report.contains(part), "{part}");
    }
    assert!(!report.contains("finite elements"));

    // nothing is run again, and a change of the label changes no run
    let (_, err) = run(dir.path(), &[]);
    assert!((1..=10).all(|run| solved(dir.path(), run) >= 1), "{err}");
    let before: Vec<usize> = (1..=10).map(|run| solved(dir.path(), run)).collect();
    let case = CASE.replace("unit = \"MPa\"", "unit = \"MPa\", label = \"k₁\"");
    std::fs::write(dir.path().join("bar.toml"), case).unwrap();
    run(dir.path(), &[]);
    assert_eq!((3..=10).map(|run| solved(dir.path(), run)).collect::<Vec<_>>(), before[2..]);
    // other runs belong to another program
    std::fs::write(dir.path().join("bar.txt"), "k1 = {k1}\n").unwrap();
    run(dir.path(), &[]);
    assert_eq!(work(dir.path()).len(), 20);
}

/// The table of runs that another case has made gives the same posterior, without a simulator.
#[test]
fn imported_runs_give_the_posterior_of_the_runs_themselves() {
    let made = folder(CASE, SOLVER);
    run(made.path(), &[]);
    let dir = folder("", "");
    let start = CASE.find("[parameters]").unwrap();
    let case = CASE[start..].replace("runs = 10", "import = \"runs.csv\"");
    std::fs::write(dir.path().join("bar.toml"), &case).unwrap();
    std::fs::copy(made.path().join("results/runs.csv"), dir.path().join("runs.csv")).unwrap();
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    assert!(told.contains("10 imported from"), "{told}");
    run(dir.path(), &[]);
    let [own, other] = [made.path(), dir.path()].map(|dir| dir.join("results"));
    for file in ["summary.csv", "map.csv", "verdict.csv", "surrogate.json"] {
        let text = |results: &Path| std::fs::read_to_string(results.join(file)).unwrap();
        assert_eq!(text(&own), text(&other), "{file}");
    }
    assert!(!other.join("confirm.csv").exists() && !other.join("ensemble").exists());
    let report = std::fs::read_to_string(other.join("report.html")).unwrap();
    assert!(report.contains("imported") && report.contains("k1 (MPa)"));
    let (code, status, _) = breccia(dir.path(), &["status", "results"]);
    assert_eq!(code, Some(0), "{status}");

    // narrower priors leave runs out
    let narrow = case.replace("[1.0, 2.0]", "[1.2, 1.9]");
    std::fs::write(dir.path().join("bar.toml"), narrow).unwrap();
    let (_, err) = run(dir.path(), &[]);
    assert!(err.contains("3 imported runs are outside the ranges of the priors"), "{err}");
    assert_eq!(table(&other.join("runs.csv")).len(), 7);
}

/// Runs that fail, hang or write nothing useful are recorded with their reasons, and the others are calibrated. Other limits
/// repeat the failed runs alone.
#[test]
fn failing_and_hanging_runs_are_left_out_and_tried_again_under_other_limits() {
    let bad = "case $2 in 2) echo 'no convergence in step 7'; exit 3;; 4) sleep 60;; 5) exit 0;; \
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
        "run-002-2",
    ] {
        assert!(failed.contains(part), "{part}: {failed}");
    }
    let of = |file: &str| -> Vec<String> {
        table(&results.join(file)).into_iter().map(|row| row["run"].clone()).collect()
    };
    assert_eq!(of("runs.csv"), ["1", "3", "8", "9", "10", "11", "12", "13", "14"]);
    let tries = |run: usize| {
        let text = std::fs::read_to_string(dir.path().join(format!("marks/tries-{run}"))).unwrap();
        text.lines().count()
    };
    assert_eq!([2, 4, 5].map(tries), [2, 2, 2]);
    assert_eq!([8, 14].map(tries), [1, 1]);
    let warnings = std::fs::read_to_string(results.join("warnings.txt")).unwrap();
    assert!(warnings.contains("5 of 14 runs"), "{warnings}");
    let [mean, sd] = exact();
    let found = number(&row_of(&results, "summary.csv", "k1"), "mean");
    assert!((found - mean).abs() < 0.2 * sd, "{found} {mean}");

    // with a longer limit and one attempt, the failed runs are made once more, and no other run
    let longer = case.replace("time_limit_s = 1.5\nretries = 1", "time_limit_s = 2.0");
    std::fs::write(dir.path().join("bar.toml"), longer).unwrap();
    run(dir.path(), &["--threads", "2"]);
    assert_eq!([2, 4, 5].map(tries), [3, 3, 3]);
    assert_eq!([8, 14].map(tries), [1, 1]);
    run(dir.path(), &["--threads", "2"]);
    assert_eq!([2, 4, 5].map(tries), [3, 3, 3]);
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
    assert_eq!((1..=3).map(|run| solved(dir.path(), run)).collect::<Vec<_>>()[0], 1);
    assert_eq!(std::fs::read_to_string(of_user).unwrap(), "mine");

    let whole = folder(CASE, SOLVER);
    run(whole.path(), &[]);
    let [own, other] = [dir.path(), whole.path()].map(|dir| dir.join("results"));
    assert_eq!(without_seconds(&own.join("runs.csv")), without_seconds(&other.join("runs.csv")));
    let text = |results: &Path| std::fs::read_to_string(results.join("summary.csv")).unwrap();
    assert_eq!(text(&own), text(&other));
}

/// Several processes share the runs: each run is made once. A study of two priors makes the runs of each case.
#[test]
fn processes_and_studies_share_the_runs_of_a_program() {
    let dir = folder(CASE, &format!("sleep 0.1\n{SOLVER}"));
    let share = ["ensemble", "bar.toml", "--out", "results", "--threads", "1", "--share"];
    let both = [0; 2].map(|_| start(dir.path(), &share));
    for process in both {
        let output = process.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!((1..=10).map(|run| solved(dir.path(), run)).collect::<Vec<_>>(), [1; 10]);
    let (code, _, err) = breccia(dir.path(), &["ensemble", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!((1..=10).map(|run| solved(dir.path(), run)).sum::<usize>(), 10);

    let dir = folder(CASE, SOLVER);
    let study = "base = \"bar.toml\"\n[[case]]\nname = \"wide\"\n[[case]]\nname = \"other\"\n\
                 set.calibration = { seed = 8 }\n";
    std::fs::write(dir.path().join("study.toml"), study).unwrap();
    let (code, _, err) = breccia(dir.path(), &["study", "study.toml", "--out", "study"]);
    assert_eq!(code, Some(0), "{err}");
    // the cases have the same runs of the design; each has two runs of its own to confirm its mode
    assert_eq!((3..=10).map(|run| solved(dir.path(), run)).sum::<usize>(), 8);
    assert!(dir.path().join("study/report.html").is_file());
}

/// A prior that cuts the posterior is extended with further runs of the program.
#[test]
fn a_prior_with_a_free_name_is_extended() {
    let narrow = CASE.replace("[1.0, 2.0]", "[1.0, 1.5]").replace("runs = 10", "runs = 6");
    let dir = folder(&narrow, SOLVER);
    let (_, err) = run(dir.path(), &["--accept-out-of-range"]);
    let offer = "extend = [{ runs = 6, prior = { k1 = [1.5, 2.0] } }]";
    assert!(err.contains(offer), "{err}");
    let goal = "[further_tests]\nwidth90 = { k1 = 0.05 }\n";
    std::fs::write(dir.path().join("bar.toml"), format!("{offer}\n{narrow}{goal}")).unwrap();
    run(dir.path(), &[]);
    let results = dir.path().join("results");
    assert_eq!(table(&results.join("runs.csv")).len(), 12);
    assert_eq!((3..=12).map(|run| solved(dir.path(), run)).collect::<Vec<_>>(), [1; 10]);
    let [mean, sd] = exact();
    let found = number(&row_of(&results, "summary.csv", "k1"), "mean");
    assert!((found - mean).abs() < 0.2 * sd, "{found} {mean}");
    let goals = table(&results.join("design_specimens.csv"));
    assert!(goals.iter().any(|row| row["goal"] == "width90" && row["parameter"] == "k1"));
}

/// A program that writes curves is compared with measured curves, which are not scaled to any mesh.
#[test]
fn curves_of_a_program_are_compared_with_measured_curves() {
    // F = k1 (u − u²/(2 d)) with its peak k1 d/2 at d = a mm
    let solver = r#"awk -v k="$1" -v a="$2" 'BEGIN { print "displacement_mm,force_n";
        for (i = 0; i <= 30; i++) { u = i * a / 20; printf "%.17g,%.17g\n", u, k * (u - u * u / (2 * a)) } }' > curve.csv"#;
    let case = r#"
[simulator]
command = ["sh", "solver.sh", "{k1}", "{a:.9e}"]
files = ["solver.sh"]
result = "curve.csv"
[parameters]
k1 = { unit = "N/mm", prior = [80.0, 120.0] }
a = { unit = "mm", prior = [0.08, 0.12] }
[qoi]
quantities = ["peak-force", "displacement-at-peak"]
[design]
runs = 24
[experiments]
table = "specimens.csv"
[calibration]
chains = 2
warmup = 300
draws = 500
[confirm]
draws = 1
"#;
    let dir = folder(case, solver);
    std::fs::create_dir(dir.path().join("curves")).unwrap();
    let mut list = "id,height_mm,radius_mm,group\n".to_owned();
    for (i, (k1, a)) in
        [(98.0, 0.101), (103.0, 0.098), (100.0, 0.1), (96.0, 0.103)].into_iter().enumerate()
    {
        list += &format!("S-{i},{},1.0,A\n", 5 + i);
        let point = |j: i32| {
            let u: f64 = f64::from(j) * a / 20.0;
            format!("{u},{}\n", k1 * (u - u * u / (2.0 * a)))
        };
        let curve: String = (0..=30).map(point).collect();
        let path = dir.path().join(format!("curves/S-{i}.csv"));
        std::fs::write(path, format!("displacement_mm,force_N\n{curve}")).unwrap();
    }
    std::fs::write(dir.path().join("specimens.csv"), list).unwrap();
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    for row in table(&results.join("experiments.csv")) {
        assert_eq!((number(&row, "displacement_factor"), number(&row, "force_factor")), (1.0, 1.0));
    }
    for row in table(&results.join("runs.csv")) {
        let [k1, a] = ["k1", "a"].map(|column| number(&row, column));
        assert!((number(&row, "peak_force_N") / (0.5 * k1 * a) - 1.0).abs() < 1e-6, "{row:?}");
        assert!((number(&row, "displacement_at_peak_mm") / a - 1.0).abs() < 1e-6, "{row:?}");
        assert!(results.join(format!("curves/run-{:0>3}.csv", row["run"])).is_file());
    }
    for (parameter, truth) in [("k1", 99.25), ("a", 0.1005)] {
        let row = row_of(&results, "summary.csv", parameter);
        let [low, high] = ["q05", "q95"].map(|column| number(&row, column));
        assert!(low < truth && truth < high, "{row:?}");
    }
    assert!(results.join("predictive_curves.csv").is_file());
    assert!(results.join("curves/map.csv").is_file());
}

#[test]
fn mistakes_are_named_with_their_remedy() {
    let dir = folder(CASE, SOLVER);
    for (from, to, parts) in [
        ("k1 = {", "k2 = {", ["bar.txt: line 2 = {k1}", "Placeholders are: k2, run"]),
        (
            "{ unit = \"MPa\", prior = [1.0, 2.0] }",
            "{ prior = [1.0, 2.0] }\nk2 = { prior = [0.0, 1.0] }",
            ["parameters.k2: has no placeholder", "Write {k2} in simulator.input"],
        ),
        ("\"bar.txt\"", "\"car.txt\"", ["simulator.input = car.txt", "is sought at"]),
        (
            "[\"sh\", ",
            "[\"./no-such-program\", ",
            ["simulator.command = ./no-such-program", "no such file"],
        ),
        (
            "\"solver.sh\"]\n[",
            "\"solver.sh\", \"bar.txt\"]\n[",
            ["simulator.files = bar.txt", "another name"],
        ),
        (
            "column:extension_mm",
            "colum:extension_mm",
            ["colum:extension_mm", "column:deflection_mm"],
        ),
        (
            "[simulator]",
            "[material.matrix]\nyoung_mpa = 1.0\n[simulator]",
            ["material: is of the built-in", "Keep one"],
        ),
        ("runs = 10", "import = \"measured.csv\"", ["simulator: makes new runs", "Keep one"]),
        ("[1.0, 2.0]", "[2.0, 1.0]", ["parameters.k1.prior", "not below the upper"]),
        ("k1 = {", "run = {", ["parameters.run", "Choose another name"]),
        (
            "\"measured.csv\"",
            "\"none.csv\"",
            ["experiments.values = none.csv", "there is no such file"],
        ),
    ] {
        assert!(CASE.contains(from), "{from}");
        std::fs::write(dir.path().join("bar.toml"), CASE.replacen(from, to, 1)).unwrap();
        let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
        assert_ne!(code, Some(0), "{to}");
        let all = format!("{told}{err}");
        assert!(parts.iter().all(|part| all.contains(part)), "{parts:?}: {all}");
    }
    // a program that is not on this machine stops the ensemble before its first run
    let absent = CASE.replace("\"sh\"", "\"no-such-solver-7\"");
    std::fs::write(dir.path().join("bar.toml"), absent).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "bar.toml", "--out", "results"]);
    assert_ne!(code, Some(0));
    assert!(err.contains("no-such-solver-7") && err.contains("PATH"), "{err}");
    // the built-in simulation knows no free names
    let built_in = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n[material.matrix]\nyoung_mpa = 275\n\
                    poisson = 0.25\n[test]\ndisplacement_mm = 0.2\n[parameters]\nk1 = { prior = [1.0, 2.0] }\n";
    std::fs::write(dir.path().join("bar.toml"), built_in).unwrap();
    let (_, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert!(format!("{told}{err}").contains("has a free name"), "{told}{err}");
    // a single run tries the program
    let bar = dir.path().join("bar.toml");
    std::fs::write(&bar, CASE).unwrap();
    let one = ["simulate", "bar.toml", "--out", "one"];
    let (code, out, err) = breccia(dir.path(), &one);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("k1 = 1.5") && err.contains("extension_mm = 4.5"), "{out}{err}");
    let result = dir.path().join(out.trim()).join("work/run-001/result.csv");
    assert!(result.is_file(), "{}", result.display());
    std::fs::write(&bar, CASE.replace("\"sh\"", "\"false\"")).unwrap();
    let (code, _, err) = breccia(dir.path(), &one);
    assert_ne!(code, Some(0));
    assert!(err.contains("the run failed: the program"), "{err}");
}
