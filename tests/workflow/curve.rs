//! Calibration to whole curves instead of three quantities, with runs on two meshes, through all stages.

use super::{breccia, number, table, without_image};

const COLUMNS: [&str; 5] = [
    "peak_force_N",
    "displacement_at_peak_mm",
    "relative_force_at_30_percent",
    "relative_force_at_70_percent",
    "relative_force_at_110_percent",
];

fn case(percent: &str) -> String {
    without_image()
        .replace("spacing_mm = 1.25\n", "")
        .replace("spacing_mm = 1.5\n", "spacing_mm = 1.2\n")
        .replace(
            "[surrogate]",
            &format!(
                "[fidelity]\nlevels = [{{ spacing_mm = 1.5, repeats = 4 }}]\n\
                 [qoi]\ncurve_percent = [{percent}]\n[surrogate]"
            ),
        )
        .replace("chains = 2\n", "chains = 2\nlikelihood = \"curve\"\n")
}

#[test]
fn curves_are_calibrated_against_from_runs_to_the_report() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("tiny.toml"), case("30, 70, 110")).unwrap();
    let run = ["run", "tiny.toml", "--out", "results", "--accept-out-of-range"];
    let (code, _, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");
    for (file, column) in [("fidelity.csv", "qoi"), ("range.csv", "qoi"), ("confirm.csv", "qoi")] {
        let named: Vec<String> =
            table(&results.join(file)).iter().map(|row| row[column].clone()).collect();
        assert_eq!(named, COLUMNS, "{file}");
    }
    // runs and specimens are evaluated in the same way, and the shapes have the expected values
    let shape = |row: &std::collections::BTreeMap<String, String>| {
        COLUMNS[2..].iter().map(|column| number(row, column)).collect::<Vec<_>>()
    };
    // predicted specimens scatter more, so that only their means are compared with the shape
    for (file, drawn) in [("runs.csv", false), ("experiments.csv", false), ("predictive.csv", true)]
    {
        let rows = table(&results.join(file));
        assert!(rows.len() >= 3, "{file}");
        for row in &rows {
            let [rise, late, after] = shape(row)[..] else { panic!("{row:?}") };
            assert!(drawn || (0.2 < rise && rise < late && late < 1.1), "{file}: {row:?}");
            assert!(drawn || (0.7 < after && after < 1.1), "{file}: {row:?}");
        }
        let shapes: Vec<_> = rows.iter().map(shape).collect();
        let mean = |k: usize| shapes.iter().map(|s| s[k]).sum::<f64>() / shapes.len() as f64;
        let [rise, late, after] = [0, 1, 2].map(mean);
        assert!(0.2 < rise && rise < late && late < 1.1, "{file}: {rise} {late}");
        assert!(0.7 < after && after < 1.1, "{file}: {after}");
    }
    let confirmed = table(&results.join("confirm.csv"));
    for row in &confirmed[2..] {
        assert!(number(row, "percent_error").abs() < 10.0, "{row:?}");
    }
    let summary = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    assert!(summary.contains("mean[relative_force_at_70_percent]"), "{summary}");
    assert!(summary.contains("correlation[force-at-70-percent,peak-force]"), "{summary}");
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("force at 70 % of the displacement at peak"));
    assert!(report.contains("curves (peak, its displacement, shape)"));
}

#[test]
fn percentages_that_no_curve_reaches_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("tiny.toml"), case("30, 190")).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(1), "{err}");
    let parts = ["190 %", "qoi.curve_percent", "test.stop_below_peak = 0.1"];
    assert!(parts.iter().all(|part| err.contains(part)), "{err}");
    std::fs::write(dir.path().join("tiny.toml"), case("70, 30")).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "other"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("qoi.curve_percent") && err.contains("ascending"), "{err}");
}
