//! The table `[calibration.discrepancy]`: errors of the finite-element model.

use super::{TINY, breccia, copy_of_tiny, number, table};

#[test]
fn an_error_of_the_model_is_in_the_intervals_and_in_the_budget() {
    let dir = copy_of_tiny();
    let case = |tail: &str| {
        let text = TINY.replace("[confirm]", &format!("{tail}\n[confirm]"));
        std::fs::write(dir.path().join("tiny.toml"), text).unwrap();
    };
    let run = ["run", "tiny.toml", "--out", "results", "--accept-out-of-range"];
    let results = dir.path().join("results");
    let sd_of_young = || {
        let summary = table(&results.join("summary.csv"));
        number(summary.iter().find(|row| row["parameter"] == "matrix.young_mpa").unwrap(), "sd")
    };
    let sources = || -> Vec<(String, f64)> {
        table(&results.join("uncertainty.csv"))
            .iter()
            .filter(|row| row["parameter"] == "matrix.young_mpa")
            .map(|row| (row["source"].clone(), number(row, "share")))
            .collect()
    };
    assert!(sources().iter().all(|(source, _)| source != "discrepancy"));
    let before = sd_of_young();

    case("[calibration.discrepancy]\npercent = { slope = 20.0, peak-force = 20.0 }");
    let (code, out, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(0), "{err}");
    // simulations are not repeated
    let told = out + &err;
    for stage in ["experiments", "ensemble", "surrogate"] {
        let line = told.lines().find(|line| line.trim_start().starts_with(stage));
        assert!(line.is_some_and(|line| line.contains("finished before")), "{told}");
    }
    let sources = sources();
    let share = |name: &str| sources.iter().find(|(source, _)| source == name).unwrap().1;
    assert!(share("discrepancy") > 0.5, "{sources:?}");
    assert!((sources.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-9);
    // with a large discrepancy the posterior is nearly the prior
    let prior = 50.0 / 12f64.sqrt();
    assert!(sd_of_young() > before && sd_of_young() > 0.8 * prior, "{before} {}", sd_of_young());
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(report.contains("error of the model that the case states"));
    assert!(report.contains("peak-force 20 %, slope 20 %"));

    case("[calibration.discrepancy]\npercent = { energy-to-peak = 3.0 }");
    let (code, _, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("discrepancy.percent.energy-to-peak") && err.contains("slope"), "{err}");
}
