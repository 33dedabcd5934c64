//! Runs on a cheap mesh, corrected by a few runs on the accurate mesh of the specimen.

use std::collections::BTreeMap;
use std::path::Path;

use super::{breccia, number, table, without_image};

const QUANTITIES: [&str; 3] = ["slope_N_per_mm", "peak_force_N", "displacement_at_peak_mm"];

/// The tiny case with a finer mesh of the specimen; most runs are on the coarse mesh.
fn case(repeats: usize) -> String {
    without_image()
        .replace("spacing_mm = 1.25\n", "")
        .replace("spacing_mm = 1.5\n", "spacing_mm = 1.2\n")
        .replace(
            "[surrogate]",
            &format!(
                "[fidelity]\nlevels = [{{ spacing_mm = 1.5, repeats = {repeats} }}]\n[surrogate]"
            ),
        )
}

fn run(folder: &Path, repeats: usize) {
    std::fs::write(folder.join("tiny.toml"), case(repeats)).unwrap();
    let (code, _, err) = breccia(folder, &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
}

/// Number of finished runs in the folder.
fn finished(results: &Path) -> usize {
    let folders = std::fs::read_dir(results.join("ensemble")).unwrap();
    let files = folders.flat_map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap());
    files
        .filter(|file| file.as_ref().unwrap().file_name().to_string_lossy().contains("run-"))
        .count()
}

#[test]
fn cheap_runs_are_corrected_by_repeated_ones() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), 4);
    let results = dir.path().join("results");
    let at_level = |level: &str| -> BTreeMap<String, BTreeMap<String, String>> {
        let rows = table(&results.join("fidelity_runs.csv")).into_iter();
        rows.filter(|row| row["level"] == level).map(|row| (row["run"].clone(), row)).collect()
    };
    let (cheap, better) = (at_level("1"), at_level("2"));
    assert_eq!((cheap.len(), better.len()), (12, 4));
    let corrected: BTreeMap<String, _> =
        table(&results.join("runs.csv")).into_iter().map(|row| (row["run"].clone(), row)).collect();
    assert_eq!(corrected.len(), 12);
    let ratios = table(&results.join("fidelity.csv"));
    for (quantity, ratio) in QUANTITIES.iter().zip(&ratios) {
        assert_eq!(ratio["qoi"], *quantity);
        // a fit of logarithms with a constant among its terms leaves residuals of mean 0
        let log = |rows: &BTreeMap<String, BTreeMap<String, String>>, run: &str| {
            number(&rows[run], quantity).ln()
        };
        let mean = |other: &BTreeMap<_, _>| {
            better.keys().map(|run| log(&better, run) - log(other, run)).sum::<f64>() / 4.0
        };
        assert!(mean(&corrected).abs() < 1e-9, "{quantity}: {}", mean(&corrected));
        // large elements are too stiff, and the ratio corrects this
        let (found, expected) = (number(ratio, "ratio"), mean(&cheap).exp());
        assert!((found / expected - 1.0).abs() < 0.05, "{ratio:?}");
        assert!(*quantity != QUANTITIES[0] || found < 0.999, "{ratio:?}");
        assert!(number(ratio, "error_percent") < number(ratio, "scatter_percent"));
    }
    // curves on the better mesh correct the shape of predicted curves
    for run in better.keys() {
        assert!(results.join(format!("curves/level-2-run-{run:0>3}.csv")).is_file(), "{run}");
    }
    let band = table(&results.join("predictive_curves.csv"));
    let quantiles = ["q05", "q25", "q50", "q75", "q95"].map(|q| format!("force_N_{q}"));
    for row in &band {
        let forces: Vec<f64> = quantiles.iter().map(|q| number(row, q)).collect();
        assert!(forces.is_sorted(), "{row:?}");
    }
    let highest = band.iter().map(|row| number(row, "force_N_q50")).fold(0.0, f64::max);
    let peaks = table(&results.join("experiments.csv"));
    let peaks: Vec<f64> = peaks.iter().map(|row| number(row, "peak_force_N")).collect();
    let mean = peaks.iter().sum::<f64>() / peaks.len() as f64;
    assert!((highest / mean - 1.0).abs() < 0.1, "{highest} {mean}");

    let sources: Vec<String> = table(&results.join("uncertainty.csv"))
        .iter()
        .filter(|row| row["parameter"] == "matrix.young_mpa")
        .map(|row| row["source"].clone())
        .collect();
    assert_eq!(sources, ["surrogate", "mesh", "geometry", "specimens"]);

    // with one more repeat, only one run is made
    let before = finished(&results);
    run(dir.path(), 5);
    assert_eq!(finished(&results), before + 1);
    assert_eq!(table(&results.join("fidelity.csv"))[0]["runs"], "5");
}

#[test]
fn levels_that_cannot_be_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let level = "{ spacing_mm = 1.5, repeats = 4 }";
    for (instead, place, problem) in [
        ("{ spacing_mm = 1.2 }", "fidelity.levels[0]", "has the mesh of [specimen]"),
        ("{ spacing_mm = 1.5, repeats = 2 }", "fidelity.levels[0].repeats = 2", "3"),
        ("{ spacing_mm = 1.5, steps = 3 }", "fidelity.levels[0].steps = 3", "10"),
        ("{ spacing_mm = 0.0 }", "fidelity.levels[0].spacing_mm = 0", "0.001"),
        (
            "{ spacing_mm = 1.5, repeats = 4 }, { spacing_mm = 1.4, repeats = 5 }",
            "fidelity.levels[1].repeats = 5",
            "between 3 and 4",
        ),
        ("{ spacing_mm = 1.5, ordr = 1 }", "ordr", "mean \"order\"?"),
    ] {
        std::fs::write(dir.path().join("tiny.toml"), case(4).replace(level, instead)).unwrap();
        let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
        assert_ne!(code, Some(0), "{instead}");
        assert!(err.contains(place) && err.contains(problem), "{instead}: {err}");
    }
}
