//! A program of the user as the source of runs (`[simulator]`), and imported runs (`design.import`): posterior against
//! numerical integration, failures, time limits, interruption, resume.

mod failures;
mod further;
mod missing;
mod refused;
mod several;
mod validation;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{breccia, number, table};

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

/// Posterior of `k1` by a sum over a grid of `k1` and of the scatter s: points and their probabilities. The specimens yᵢ have
/// the density N(yᵢ/ȳ; 3 k1/ȳ, s), k1 is uniform, and s has the prior Normal(0.15, 0.25), s > 0.
fn exact() -> Vec<[f64; 2]> {
    let mean = MEASURED.iter().sum::<f64>() / MEASURED.len() as f64;
    let steps = 1000;
    let at = |i: i32, from: f64, width: f64| from + width * (f64::from(i) + 0.5) / f64::from(steps);
    let weight = |k1: f64| -> f64 {
        let squares: f64 = MEASURED.iter().map(|y| ((y - 3.0 * k1) / mean).powi(2)).sum();
        let ln = |s: f64| {
            let count = MEASURED.len() as f64;
            -0.5 * squares / (s * s) - count * s.ln() - 0.5 * ((s - 0.15) / 0.25).powi(2)
        };
        (0..steps).map(|j| ln(at(j, 0.0, 1.0)).exp()).sum()
    };
    let points: Vec<[f64; 2]> =
        (0..steps).map(|i| at(i, 1.0, 1.0)).map(|k1| [k1, weight(k1)]).collect();
    let total: f64 = points.iter().map(|[_, weight]| weight).sum();
    points.into_iter().map(|[k1, weight]| [k1, weight / total]).collect()
}

/// Checks the quantiles of `k1` in `summary.csv`: their exact probabilities are 5, 50 and 95 % within four standard errors.
fn check_posterior(results: &Path) {
    let (exact, summary) = (exact(), row_of(results, "summary.csv", "k1"));
    for (column, p) in [("q05", 0.05), ("q50", 0.5), ("q95", 0.95)] {
        let quantile = number(&summary, column);
        let below = exact.iter().filter(|[k1, _]| *k1 < quantile);
        let found: f64 = below.map(|[_, weight]| weight).sum();
        let draws = number(&summary, "ess_bulk").min(number(&summary, "ess_tail"));
        let error = f64::sqrt(p * (1.0 - p) / draws);
        assert!((found - p).abs() < 4.0 * error, "{column}: {found} ± {error}, {summary:?}");
    }
}

fn row_of(results: &Path, file: &str, parameter: &str) -> BTreeMap<String, String> {
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
    check_posterior(&results);
    assert_eq!(row_of(&results, "verdict.csv", "k1")["verdict"], "identified");
    let confirm = table(&results.join("confirm.csv"));
    let map = number(&row_of(&results, "map.csv", "k1"), "map");
    assert!((number(&confirm[0], "map_simulation") - 3.0 * map).abs() < 1e-9, "{confirm:?}");

    // each run has a folder with its files and the printed text of the program
    let folders = work(dir.path());
    assert_eq!(folders.len(), 10);
    let text = |name: &str| std::fs::read_to_string(folders[6].join(name)).unwrap();
    let k1 = &runs[6]["k1"];
    assert_eq!(text("bar.txt"), format!("# {{k1}} in MPa\nk1 = {k1}\n"));
    assert_eq!(text("program-output.txt"), format!("k1 = {k1} is solved\n"));
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in [
        "k1 (MPa)",
        "extension_mm",
        "Confirming simulation",
        "with the command sh solver.sh {input} {run}.",
        "B-3",
    ] {
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

    // runs outside narrower priors are omitted
    let narrow = case.replace("[1.0, 2.0]", "[1.2, 1.9]");
    std::fs::write(dir.path().join("bar.toml"), narrow).unwrap();
    let (_, err) = run(dir.path(), &[]);
    assert!(err.contains("3 imported runs are outside the ranges of the priors"), "{err}");
    assert_eq!(table(&other.join("runs.csv")).len(), 7);
}
