//! `[[validation]]` with built-in simulations: virtual specimens of the calibrated test and of another test.

use super::{TINY, breccia, copy_of_tiny, number, table};

/// The tiny case is shorter in the second validation. Two specimens are held out of each.
const VALIDATIONS: &str = r#"
[[validation]]
name = "again"
set.experiments.virtual.specimens = 2
[[validation]]
name = "short"
draws = 4
set.specimen.height_mm = 3.9
set.test.displacement_mm = 0.2
set.experiments.virtual.specimens = 2
set.qoi.quantities = ["slope", "peak-force", "energy-to-peak"]
"#;

#[test]
fn simulations_at_posterior_draws_predict_another_specimen() {
    let dir = copy_of_tiny();
    std::fs::write(dir.path().join("tiny.toml"), format!("{TINY}{VALIDATIONS}")).unwrap();
    let run = ["run", "tiny.toml", "--out", "results", "--threads", "2"];
    let (code, out, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(0), "{err}");
    let told = out + &err;
    // the calibration is not repeated
    for stage in ["ensemble", "surrogate", "calibrate", "confirm"] {
        let line = told.lines().find(|line| line.trim_start().starts_with(stage));
        assert!(line.is_some_and(|line| line.contains("finished before")), "{stage}: {told}");
    }
    let results = dir.path().join("results");
    let summary = table(&results.join("validation_summary.csv"));
    let of = |name: &str, column: &str| {
        let is_own = |row: &&_| {
            let row: &std::collections::BTreeMap<String, String> = row;
            row["validation"] == name && row["qoi"] == column
        };
        summary.iter().find(is_own).unwrap_or_else(|| panic!("{name} {column}: {summary:?}"))
    };
    assert_eq!(summary.len(), 6);
    assert_eq!(of("again", "peak_force_N")["method"], "surrogate");
    assert_eq!(of("again", "peak_force_N")["draws"], "300");
    assert_eq!(of("short", "peak_force_N")["method"], "simulations");
    assert_eq!(of("short", "peak_force_N")["draws"], "4");
    // the energy is not calibrated, so that its scatter is not predicted
    assert_eq!(of("short", "peak_force_N")["scatter_is_predicted"], "true");
    assert_eq!(of("short", "energy_to_peak_N_mm")["scatter_is_predicted"], "false");
    assert!(told.contains("the scatter of energy_to_peak_N_mm between specimens"), "{told}");
    // the stiffness of a cylinder is inversely proportional to its height
    let slopes = ["again", "short"].map(|name| {
        let column = summary.iter().find(|row| row["qoi"].starts_with("slope")).unwrap();
        number(of(name, &column["qoi"]), "predicted_mean")
    });
    assert!((slopes[1] / slopes[0] * 3.9 / 4.4 - 1.0).abs() < 0.1, "{slopes:?}");
    let curves = table(&results.join("validation_curves.csv"));
    assert!(curves.iter().any(|row| row["validation"] == "short" && row["curves"] == "2"));
    // the folders have the specimen and the runs of the validation
    let short = results.join("validation/short");
    for name in ["case.toml", "mesh.msh", "experiments.csv", "experiments/specimens.csv", "runs"] {
        assert!(short.join(name).exists(), "{name}");
    }
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(
        report.contains("Validation with held-out specimens") && report.contains("<h3>short</h3>")
    );

    // the results folder contains a complete case: `breccia run` without a case file uses this case
    let (code, out, err) = breccia(dir.path(), &["run", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let told = out + &err;
    let line = told.lines().find(|line| line.trim_start().starts_with("validate"));
    assert!(line.is_some_and(|line| line.contains("finished before")), "{told}");
    let (code, status, err) = breccia(dir.path(), &["status", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(status.contains("validate"), "{status}");
}
