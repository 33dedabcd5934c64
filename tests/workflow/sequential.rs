//! Batches of runs that are placed in the posterior.

use std::collections::BTreeSet;
use std::path::Path;

use super::{breccia, finished, number, start, table, without_image, without_seconds};

const BATCHES: &str = "[sequential]\nshare = 0.001\nbatch = 4\nmost = 8\n[surrogate]";

/// The tiny case with fewer runs of the design, and with batches.
fn case() -> String {
    without_image()
        .replace("runs = 12", "runs = 8")
        .replace("max_order = 2", "max_order = 1")
        .replace("[surrogate]", BATCHES)
}

fn run(folder: &Path, case: &str, arguments: &[&str]) -> String {
    std::fs::write(folder.join("tiny.toml"), case).unwrap();
    let (code, _, err) = breccia(folder, arguments);
    assert_eq!(code, Some(0), "{err}");
    err
}

/// Runs are added in the posterior until `most` is reached, and the surrogate's share of the variance decreases.
/// Finished runs are not made again, a larger `most` adds runs, and `status` counts the runs.
#[test]
fn batches_are_placed_where_the_posterior_lives() {
    let dir = tempfile::tempdir().unwrap();
    let all = ["run", "tiny.toml", "--out", "results"];
    let err = run(dir.path(), &case(), &all);
    assert!(err.contains("sequential.most = 8") && err.contains("raise `most`"), "{err}");
    let results = dir.path().join("results");
    let runs = table(&results.join("runs.csv"));
    let batches: Vec<&str> = runs.iter().map(|row| row["batch"].as_str()).collect();
    assert_eq!(batches, [[""; 4], [""; 4], ["1"; 4], ["2"; 4]].concat());
    let seeds: BTreeSet<&str> = runs.iter().map(|row| row["packing_seed"].as_str()).collect();
    assert_eq!(seeds.len(), 16, "each has a packing of its own");
    // twelve runs determine the posterior of E and ξ well enough that the last four runs are placed in this posterior
    let draws = table(&results.join("posterior.csv"));
    for parameter in ["matrix.young_mpa", "matrix.viscosity_mpa_s"] {
        let values: Vec<f64> = draws.iter().map(|row| number(row, parameter)).collect();
        let ends = values
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &x| [a.min(x), b.max(x)]);
        let margin = 0.5 * (ends[1] - ends[0]);
        for row in &runs[12..] {
            let x = number(row, parameter);
            assert!(ends[0] - margin < x && x < ends[1] + margin, "{parameter}: {x} {ends:?}");
        }
    }
    let share = |batches: &str| {
        let rows = table(&results.join("sequential.csv"));
        let row = rows
            .iter()
            .find(|row| row["batches"] == batches && row["parameter"] == "matrix.viscosity_mpa_s");
        number(row.unwrap(), "surrogate_share")
    };
    assert!(share("2") < 0.7 * share("0"), "{} {}", share("0"), share("2"));
    let warnings = std::fs::read_to_string(results.join("warnings.txt")).unwrap();
    assert!(warnings.contains("sequential.share"), "{warnings}");
    let (_, told, _) = breccia(dir.path(), &["status", "results"]);
    assert!(told.contains("16 of 16 runs"), "{told}");

    // the same command makes no runs; a larger `most` keeps the runs and adds four
    let before = finished(&results.join("ensemble"));
    run(dir.path(), &case(), &all);
    assert_eq!(finished(&results.join("ensemble")), before);
    run(dir.path(), &case().replace("most = 8", "most = 12"), &all);
    let now = finished(&results.join("ensemble"));
    assert_eq!(now.len(), before.len() + 4);
    assert!(before.iter().all(|(path, time)| now.get(path) == Some(time)), "a run was made twice");
    assert_eq!(table(&results.join("runs.csv"))[..16], runs[..]);

    // if `share` is already reached, no runs of batches are used; finished runs of batches are kept in the folder
    run(dir.path(), &case().replace("share = 0.001", "share = 1.0"), &all);
    assert_eq!(table(&results.join("runs.csv")).len(), 8);
    assert_eq!(finished(&results.join("ensemble")), now);
}

/// Processes that share the runs, on cheap meshes with corrections, make the same runs as a single process.
#[test]
fn processes_share_batches() {
    let case = case()
        .replace("spacing_mm = 1.25\n", "")
        .replace("spacing_mm = 1.5\n", "spacing_mm = 1.2\n")
        .replace(
            "[sequential]",
            "[fidelity]\nlevels = [{ spacing_mm = 1.5, repeats = 3 }]\n[sequential]",
        );
    let dir = tempfile::tempdir().unwrap();
    let until = |out: &str| {
        for stage in ["segment", "mesh", "experiments"] {
            run(dir.path(), &case, &[stage, "tiny.toml", "--out", out]);
        }
    };
    until("alone");
    run(dir.path(), &case, &["ensemble", "tiny.toml", "--out", "alone"]);
    until("shared");
    let worker = ["ensemble", "tiny.toml", "--out", "shared", "--share", "--threads", "1"];
    let workers = [(); 2].map(|()| start(dir.path(), &worker));
    for worker in workers {
        let output = worker.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let [alone, shared] = ["alone", "shared"].map(|name| dir.path().join(name));
    let made = finished(&shared.join("ensemble"));
    assert_eq!(made.len(), 8 + 3 + 8);
    run(dir.path(), &case, &["ensemble", "--out", "shared"]);
    let now = finished(&shared.join("ensemble"));
    assert!(made.iter().all(|(path, time)| now.get(path) == Some(time)), "a run was made twice");
    for name in ["runs.csv", "sequential.csv", "fidelity.csv"] {
        let [a, b] = [&alone, &shared].map(|dir| without_seconds(&dir.join(name)));
        assert_eq!(a, b, "{name}");
    }
}

/// If all runs are on one specimen, the error of the surrogate is the covariance of the leave-one-out residuals of the
/// batches.
#[test]
fn on_one_specimen_the_error_is_that_of_the_batches() {
    let dir = tempfile::tempdir().unwrap();
    // the tested specimens, each with its own packing, are softer than this specimen
    let case = case()
        .replace("runs = 8", "runs = 8\nmicrostructure = \"one\"")
        .replace("matrix.young_mpa = [250.0, 300.0]", "matrix.young_mpa = [230.0, 300.0]");
    run(dir.path(), &case, &["run", "tiny.toml", "--out", "results"]);
    let results = dir.path().join("results");
    let runs = surrogate::Dataset::read_csv(results.join("runs.csv")).unwrap();
    assert_eq!(runs.len(), 16);
    let order = table(&results.join("surrogate_orders.csv")).len();
    assert!(order > 0);
    let options = surrogate::FitOptions { max_order: 1, ..surrogate::FitOptions::default() };
    let fit = surrogate::DynPce::fit(&runs, &options).unwrap();
    let placed: Vec<usize> = (8..16).collect();
    let text = std::fs::read_to_string(results.join("surrogate_error.json")).unwrap();
    let found: surrogate::FitReport = serde_json::from_str(&text).unwrap();
    let at = runs.row(0).1;
    let expected = fit.about(&placed).unwrap().lack_of_fit(at).unwrap();
    assert_eq!(found.lack_of_fit(at).unwrap(), expected);
    assert_ne!(fit.report.lack_of_fit(at).unwrap(), expected);
}
