//! Specimens that lack quantities: empty cells of a table of measured quantities, and curves that end before their peak.

use std::path::Path;

use super::super::{breccia, number, table};
use super::{SOLVER, exact, folder, row_of, run};

/// A second quantity that hardly depends on k1.
const TWO: &str = r#"
[simulator]
command = ["sh", "solver.sh", "{input}", "{run}"]
input = "bar.txt"
files = ["solver.sh"]
[parameters]
k1 = { unit = "MPa", prior = [1.0, 2.0] }
[qoi]
quantities = ["column:extension_mm", "column:force_n"]
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

fn two_quantities() -> String {
    let solver = SOLVER.replace("\"extension_mm\"", "\"extension_mm,force_n\"");
    solver.replace("\"%.17g\\n\", 3 * k", "\"%.17g,%.17g\\n\", 3 * k, 4.9985 + 0.001 * k")
}

fn measured(dir: &Path, rows: &str) {
    std::fs::write(dir.join("measured.csv"), format!("id,extension_mm,force_n\n{rows}")).unwrap();
}

/// Six specimens have an extension, and two of them have a force, too. Three further specimens have only a force. The
/// force hardly depends on k1, so that k1 has the posterior of the extensions alone, except for the correlation of
/// extension and force. The effect of the correlation is small: only two specimens have both quantities, and their
/// forces are near the mean force.
#[test]
fn empty_cells_are_missing_quantities() {
    let dir = folder(TWO, &two_quantities());
    let extensions = super::MEASURED;
    let force = |k: usize| if k < 2 { "5.0" } else { "" };
    let mut rows: String =
        extensions.iter().enumerate().map(|(k, u)| format!("B-{k},{u:?},{}\n", force(k))).collect();
    rows += "F-1,,5.3\nF-2,,4.6\nF-3,,5.1\n";
    measured(dir.path(), &rows);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    let extension =
        "column:extension_mm is compared for 6 of 9 specimens, because 3 specimens lack it";
    let force = "column:force_n is compared for 5 of 9 specimens, because 4 specimens lack it";
    assert!(told.contains(extension) && told.contains(force), "{told}");

    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    let warnings = std::fs::read_to_string(results.join("warnings.txt")).unwrap();
    assert!(warnings.contains(extension) && warnings.contains(force), "{warnings}");
    // the exact probabilities of the quantiles of k1 agree within four standard errors and 2 %; the 2 % are for the
    // correlation, which the exact probabilities neglect
    let summary = row_of(&results, "summary.csv", "k1");
    let exact = exact();
    for (column, p) in [("q05", 0.05), ("q50", 0.5), ("q95", 0.95)] {
        let quantile = number(&summary, column);
        let found: f64 =
            exact.iter().filter(|[k1, _]| *k1 < quantile).map(|[_, weight]| weight).sum();
        let draws = number(&summary, "ess_bulk").min(number(&summary, "ess_tail"));
        let error = f64::sqrt(p * (1.0 - p) / draws);
        assert!((found - p).abs() < 0.02 + 4.0 * error, "{column}: {found} ± {error}");
    }
    let fit = table(&results.join("fit.csv"));
    let means = [extensions.iter().sum::<f64>() / 6.0, (5.0 + 5.0 + 5.3 + 4.6 + 5.1) / 5.0];
    for (row, mean) in fit.iter().zip(means) {
        assert!((number(row, "experiment_mean") - mean).abs() < 1e-12, "{row:?}");
        assert!(number(row, "sd_percent") > 0.0);
    }
    let loo = table(&results.join("loo.csv"));
    assert!(loo.len() == 9 && loo.iter().all(|row| number(row, "elpd").is_finite()), "{loo:?}");
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("<td>–</td>") && report.contains("lacks the quantity"));
    assert!(!report.contains("NaN"));
}

#[test]
fn a_quantity_without_a_value_and_a_specimen_without_a_quantity_are_refused() {
    let dir = folder(TWO, &two_quantities());
    for (rows, problem) in [
        ("B-1,4.4,\nB-2,4.9,\n", "column force_n: has no number for any specimen"),
        ("B-1,4.4,5.0\nB-2,,\n", "column id = B-2: has no quantity"),
        ("B-1,4.4,5.0\nB-2,4.9,–\n", "is not a finite number"),
    ] {
        measured(dir.path(), rows);
        let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
        assert_ne!(code, Some(0), "{told}");
        assert!(format!("{told}{err}").contains(problem), "{problem}: {told}{err}");
    }
}

/// The force is F = k u up to the peak k a at u = a mm; beyond the peak it falls with the slope −k.
const CURVES: &str = r#"
awk -v k="$1" -v a="$2" 'BEGIN { print "displacement_mm,force_n";
for (i = 0; i <= 30; i++) { u = i * a / 20; printf "%.17g,%.17g\n", u, k * (u <= a ? u : 2 * a - u) } }' > curve.csv"#;

const CURVE_CASE: &str = r#"
[simulator]
command = ["sh", "solver.sh", "{k}", "{a:.9e}"]
files = ["solver.sh"]
result = "curve.csv"
[parameters]
k = { unit = "N/mm", prior = [80.0, 120.0] }
a = { unit = "mm", prior = [0.08, 0.12] }
[qoi]
quantities = ["force-at-0.05-mm", "peak-force"]
[design]
runs = 24
[experiments]
table = "specimens.csv"
[calibration]
chains = 2
warmup = 300
draws = 1000
[confirm]
draws = 1
"#;

/// Writes specimens with slopes k. The curves of the first `ended` specimens end before the peak at 0.1 mm.
fn write_curves(dir: &Path, slopes: &[f64], ended: usize) {
    std::fs::create_dir_all(dir.join("curves")).unwrap();
    let mut list = "id,height_mm,radius_mm,group\n".to_owned();
    for (i, k) in slopes.iter().enumerate() {
        list += &format!("S-{i},5.0,1.0,A\n");
        let last = if i < ended { 17 } else { 30 };
        // the specimens have the slope k, and peaks that do not depend on k alone
        let bend = [0.01, -0.02, 0.015, -0.005][i % 4];
        let force = |j: i32| {
            let u = f64::from(j) * 0.005;
            let further = bend * (0.04 - (u - 0.1).abs()).max(0.0);
            format!("{u},{}\n", k * (u.min(0.2 - u) + further))
        };
        let curve: String = (0..=last).map(force).collect();
        let text = format!("displacement_mm,force_N\n{curve}");
        std::fs::write(dir.join(format!("curves/S-{i}.csv")), text).unwrap();
    }
    std::fs::write(dir.join("specimens.csv"), list).unwrap();
}

/// Curves that end before their peak give the force at 0.05 mm and no peak force: `breccia check` names the reason. The force
/// at 0.05 mm of all specimens determines k.
#[test]
fn curves_that_end_before_the_peak_give_the_other_quantities() {
    let dir = folder(CURVE_CASE, CURVES);
    let slopes = [99.0, 101.5, 97.5, 103.0, 100.5, 98.0, 102.0, 100.0];
    write_curves(dir.path(), &slopes, 3);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    for part in [
        "S-1 has no peak-force: no peak: the force is highest at the end of the curve",
        "peak-force is compared for 5 of 8 specimens, because 3 specimens lack it",
        "force_at_0.05_mm_N: mean 5.00938",
    ] {
        assert!(told.contains(part), "{part}: {told}");
    }
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    let experiments = table(&results.join("experiments.csv"));
    for (row, k) in experiments.iter().zip(slopes) {
        assert!((number(row, "force_at_0.05_mm_N") - 0.05 * k).abs() < 1e-9, "{row:?}");
    }
    assert!(experiments[..3].iter().all(|row| row["peak_force_N"].is_empty()));
    assert!(experiments[3..].iter().all(|row| number(row, "peak_force_N") > 9.0));
    let checks = table(&results.join("curve_checks.csv"));
    assert_eq!(checks.iter().filter(|row| row["finding"] == "missing").count(), 3);
    // the mean of all eight slopes is 100.19
    let k = row_of(&results, "summary.csv", "k");
    assert!((number(&k, "mean") - 100.19).abs() < 1.5, "{k:?}");
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("<td>–</td>") && !report.contains("NaN"));

    // a quantity that no curve gives
    write_curves(dir.path(), &slopes, 8);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_ne!(code, Some(0), "{told}");
    assert!(
        format!("{told}{err}").contains("no specimen has peak-force. S-0: no peak"),
        "{told}{err}"
    );
}
