//! `[[validation]]` with a program as the source of runs: held-out specimens of the calibrated test and of another test.

use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::super::{breccia, number, table};
use super::{folder, row_of, run};

/// F rises by t k u to its peak t k a at u = a mm and falls as steeply. The factor t is 1 for the calibrated test.
const SOLVER: &str = r#"echo solved >> "$MARKS/$4"
awk -v k="$1" -v a="$2" -v t="$3" 'BEGIN { print "displacement_mm,force_n";
for (i = 0; i <= 30; i++) { u = i * a / 20; printf "%.17g,%.17g\n", u, t * k * (u <= a ? u : 2 * a - u) } }' > curve.csv"#;

const CASE: &str = r#"
[simulator]
command = ["sh", "solver.sh", "{k}", "{a:.9e}", "1", "{run}"]
files = ["solver.sh"]
result = "curve.csv"
[parameters]
k = { unit = "N/mm", prior = [80.0, 120.0] }
a = { unit = "mm", prior = [0.08, 0.12] }
[qoi]
quantities = ["peak-force", "displacement-at-peak"]
[design]
runs = 24
[experiments]
table = "specimens.csv"
group = "calibrated"
[calibration]
chains = 2
warmup = 300
draws = 1000
[confirm]
draws = 1
[[validation]]
name = "more"
set.experiments.group = "more"
[[validation]]
name = "thick"
draws = 12
set.simulator.command = ["sh", "solver.sh", "{k}", "{a:.9e}", "2", "{run}"]
set.experiments.table = "thick/specimens.csv"
set.experiments.group = "thick"
"#;

/// Scatter of k and a between specimens.
const SCATTER: f64 = 0.02;

/// A specimen: name, group, k and a.
struct Specimen(String, &'static str, f64, f64);

fn specimens(seed: u64, group: &'static str, count: usize, factor: f64) -> Vec<Specimen> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut about = |mean: f64| mean * (SCATTER * rng.sample::<f64, _>(StandardNormal)).exp();
    (0..count)
        .map(|i| Specimen(format!("{group}-{i}"), group, about(100.0 * factor), about(0.1)))
        .collect()
}

/// Writes a table of specimens with their curves.
fn write_specimens(dir: &Path, all: &[Specimen], factor: f64) {
    std::fs::create_dir_all(dir.join("curves")).unwrap();
    let mut list = "id,height_mm,radius_mm,group\n".to_owned();
    for Specimen(id, group, k, a) in all {
        list += &format!("{id},5.0,1.0,{group}\n");
        let point = |j: i32| {
            let u: f64 = f64::from(j) * a / 20.0;
            format!("{u},{}\n", factor * k * u.min(2.0 * a - u))
        };
        let curve: String = (0..=30).map(point).collect();
        let path = dir.join(format!("curves/{id}.csv"));
        std::fs::write(path, format!("displacement_mm,force_N\n{curve}")).unwrap();
    }
    std::fs::write(dir.join("specimens.csv"), list).unwrap();
}

/// The case with its specimens. The forces of the thick specimens are multiplied by `shift`.
fn case_with(shift: f64) -> tempfile::TempDir {
    let dir = folder(CASE, SOLVER);
    let mut own = specimens(1, "calibrated", 8, 1.0);
    own.extend(specimens(2, "more", 6, 1.0));
    write_specimens(dir.path(), &own, 1.0);
    write_specimens(&dir.path().join("thick"), &specimens(3, "thick", 6, shift), 2.0);
    dir
}

fn text(dir: &Path, name: &str) -> String {
    std::fs::read_to_string(dir.join("results").join(name)).unwrap()
}

fn verdicts(dir: &Path) -> Vec<(String, String, String)> {
    let rows = table(&dir.join("results/validation_summary.csv"));
    rows.iter()
        .map(|row| (row["validation"].clone(), row["qoi"].clone(), row["verdict"].clone()))
        .collect()
}

#[test]
fn specimens_of_the_truth_are_covered_by_their_prediction() {
    let dir = case_with(1.0);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    for part in ["validation more", "by the surrogate", "validation thick", "by 12 simulations"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    run(dir.path(), &["--threads", "1"]);
    let results = dir.path().join("results");
    let verdicts = verdicts(dir.path());
    assert_eq!(verdicts.len(), 4);
    assert!(verdicts.iter().all(|(_, _, verdict)| verdict == "consistent"), "{verdicts:?}");
    assert_eq!(row_of(&results, "verdict.csv", "k")["verdict"], "identified");
    assert!(!text(dir.path(), "warnings.txt").contains("held-out"));

    // the surrogate predicts new specimens as the calibration does, and the thick specimens have twice its force
    let predictive = table(&results.join("predictive.csv"));
    let mut forces: Vec<f64> = predictive.iter().map(|row| number(row, "peak_force_N")).collect();
    forces.sort_by(f64::total_cmp);
    let quantile = |p: f64| forces[(p * forces.len() as f64) as usize];
    let width = quantile(0.95) - quantile(0.05);
    let rows = table(&results.join("validation.csv"));
    assert_eq!(rows.len(), 2 * (6 + 6));
    for row in rows.iter().filter(|row| row["qoi"] == "peak_force_N") {
        let factor = if row["validation"] == "thick" { 2.0 } else { 1.0 };
        for (column, p) in [("q05", 0.05), ("median", 0.5), ("q95", 0.95)] {
            let difference = number(row, column) / factor - quantile(p);
            // quantiles of 2000 draws, and of 12 simulations
            assert!(difference.abs() < 0.15 * width, "{column}: {difference} {width} {row:?}");
        }
        let [pit, crps] = ["pit", "crps"].map(|column| number(row, column));
        let away = (number(row, "measured") - number(row, "median")).abs();
        assert!((0.0..=1.0).contains(&pit) && crps < away + 0.3 * factor * width, "{row:?}");
        let is_inside = |low: &str, high: &str| {
            (number(row, low)..=number(row, high)).contains(&number(row, "measured"))
        };
        assert_eq!(row["inside90"], is_inside("q05", "q95").to_string());
        assert_eq!(row["inside50"], is_inside("q25", "q75").to_string());
    }
    for row in table(&results.join("validation_coverage.csv")) {
        let inside = rows.iter().filter(|own| {
            own[if row["level"] == "0.5" { "inside50" } else { "inside90" }] == "true"
        });
        assert_eq!(row["inside"], inside.count().to_string());
        let [low, level, high] = ["low", "level", "high"].map(|column| number(&row, column));
        assert!(low < level && level < high, "{row:?}");
    }
    let curves = table(&results.join("validation_curves.csv"));
    for name in ["more", "thick"] {
        let own: Vec<_> = curves.iter().filter(|row| row["validation"] == name).collect();
        let sum = |column: &str| own.iter().map(|row| number(row, column)).sum::<f64>();
        assert!(own.len() > 20 && sum("inside90") > 0.6 * sum("curves"), "{name}");
    }
    let report = text(dir.path(), "report.html");
    for part in ["Validation with held-out specimens", "<h3>thick</h3>", "consistent with"] {
        assert!(report.contains(part), "{part}");
    }

    // finished runs and stages are reused; other threads give the same files
    let before = text(dir.path(), "validation.csv");
    let (out, err) = run(dir.path(), &[]);
    let told = out + &err;
    let line = told.lines().find(|line| line.trim_start().starts_with("validate"));
    assert!(line.is_some_and(|line| line.contains("finished before")), "{told}");
    let marks = || std::fs::read_to_string(dir.path().join("marks/7")).unwrap().lines().count();
    let solved = marks();
    for stage in ["validation.csv", "validation_summary.csv"] {
        std::fs::remove_file(results.join(stage)).unwrap();
    }
    run(dir.path(), &["--threads", "2"]);
    assert_eq!(text(dir.path(), "validation.csv"), before);
    assert_eq!(marks(), solved);
    // another number of draws repeats this stage only
    let case = CASE.replace("draws = 12", "draws = 11");
    std::fs::write(dir.path().join("bar.toml"), case).unwrap();
    let (out, err) = run(dir.path(), &["--threads", "2"]);
    let told = out + &err;
    let is_again = |stage: &str| {
        let line = told.lines().find(|line| line.trim_start().starts_with(stage)).unwrap();
        !line.contains("finished before")
    };
    assert!(is_again("validate") && !is_again("calibrate") && !is_again("confirm"), "{told}");
}

#[test]
fn shifted_specimens_contradict_their_prediction() {
    let dir = case_with(1.25);
    run(dir.path(), &["--threads", "2"]);
    for (validation, qoi, verdict) in verdicts(dir.path()) {
        let is_shifted = validation == "thick" && qoi == "peak_force_N";
        let expected = if is_shifted { "contradicted" } else { "consistent" };
        assert_eq!(verdict, expected, "{validation} {qoi}");
    }
    // the verdict contains a comma, and therefore quotation marks
    let verdict = text(dir.path(), "verdict.csv");
    for parameter in ["a", "k"] {
        let of_parameter = |line: &&str| line.starts_with(&format!("{parameter},"));
        let line = verdict.lines().find(of_parameter).unwrap();
        assert!(line.ends_with("\"identified, validation failed\""), "{line}");
    }
    for file in ["warnings.txt", "summary.txt", "report.html"] {
        let text = text(dir.path(), file);
        assert!(
            text.contains("does not predict the held-out specimens of the validation thick"),
            "{file}"
        );
    }
}

#[test]
fn specimens_of_the_calibration_are_refused_by_name() {
    let dir = case_with(1.0);
    // the curve of a calibrated specimen under another name
    let from = dir.path().join("curves/calibrated-3.csv");
    std::fs::copy(from, dir.path().join("thick/curves/thick-2.csv")).unwrap();
    for command in ["check", "run"] {
        let (code, out, err) = breccia(dir.path(), &[command, "bar.toml"]);
        assert_eq!(code, Some(1), "{out}{err}");
        let told = out + &err;
        for part in ["thick-2", "calibrated-3", "thick/specimens.csv", "Hold the specimen out"] {
            assert!(told.contains(part), "{part}: {told}");
        }
    }
    let refused = |from: &str, to: &str, parts: &[&str]| {
        assert!(CASE.contains(from), "{from}");
        std::fs::write(dir.path().join("bar.toml"), CASE.replace(from, to)).unwrap();
        let (code, out, err) = breccia(dir.path(), &["check", "bar.toml"]);
        assert_eq!(code, Some(1), "{out}{err}");
        let told = out + &err;
        for part in parts {
            assert!(told.contains(part), "{part}: {told}");
        }
    };
    refused(
        "set.experiments.group = \"more\"\n",
        "",
        &["names the specimens of the calibration", "set.experiments.table"],
    );
    refused("draws = 12", "draws = 2", &["validation (thick).draws", "2"]);
    refused("name = \"thick\"", "name = \"more\"", &["two validations"]);
    refused("name = \"thick\"", "name = \"a/b\"", &["not the name of a folder"]);
    refused("draws = 12", "set.prior.k = [1.0, 2.0]", &["belongs to the calibration", "prior"]);
    refused("draws = 12", "scatter_percent = { slope = 3.0 }", &["is not compared", "slope"]);
    refused("draws = 12", "scatter_percent = { peak-force = 300.0 }", &["300", "scatter_percent"]);
}
