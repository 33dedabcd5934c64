//! Shipped cases with several tests, on coarser meshes and with fewer runs.

use std::path::PathBuf;

use super::*;

/// A shipped case, changed at some places of its text, and its results.
fn results(name: &str, changes: &[(&str, &str)], out: &Path) -> PathBuf {
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases");
    let mut text = std::fs::read_to_string(cases.join(format!("{name}.toml"))).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{name} has no {from:?}");
        text = text.replacen(from, to, 1);
    }
    if cases.join(name).is_dir() {
        copy(&cases.join(name), &out.join(name));
    }
    std::fs::write(out.join("case.toml"), text).unwrap();
    let run = ["run", "case.toml", "--out", "results", "--threads", "2"];
    let (code, _, err) = breccia(out, &run);
    assert_eq!(code, Some(0), "{err}");
    out.join("results")
}

/// Mean and standard deviation of a parameter of the joint posterior.
fn posterior(results: &Path, parameter: &str) -> [f64; 2] {
    let rows = table(&results.join("summary.csv"));
    let row = rows.iter().find(|row| row["parameter"] == parameter);
    let row = row.unwrap_or_else(|| panic!("no {parameter}: {rows:?}"));
    [number(row, "mean"), number(row, "sd")]
}

/// One modulus and one viscosity describe the three rates, because the relaxation of the binder is known.
#[test]
fn a_binder_at_three_rates_has_its_true_parameters() {
    let dir = tempfile::tempdir().unwrap();
    let changes = [
        ("spacing_mm = 1.2", "spacing_mm = 1.5"),
        ("runs = 20", "runs = 8\nmicrostructure = \"one\""),
        ("specimens = 6", "specimens = 4"),
        ("draws = 1000", "draws = 200\nwarmup = 200\nchains = 2"),
        ("draws = 1\nsecond_spacing_mm = 0.9", "draws = 0\nsecond_spacing_mm = 1.3"),
    ];
    let results = results("binder-rates", &changes, dir.path());
    for (parameter, truth, most) in
        [("matrix.young_mpa", 275.0, 15.0), ("matrix.viscosity_mpa_s", 0.3, 0.05)]
    {
        let [mean, sd] = posterior(&results, parameter);
        assert!((mean - truth).abs() < 4.0 * sd && sd < most, "{parameter}: {mean} ± {sd}");
    }
}

/// Built-in simulations of bars and a closed form for rate tests, in one case: the yield stress and the rate factor are
/// shared, the hardening belongs to the bars and the offset factor to the rate tests. Uniform bars have a closed form for
/// the shared parameters: docs/tutorials/steel.md has the posterior of the example.
#[test]
fn steel_bars_and_rate_tests_are_calibrated_together() {
    let dir = tempfile::tempdir().unwrap();
    let changes = [
        ("steps = 20", "steps = 8"),
        ("runs = 20", "runs = 10"),
        ("max_order = 3", "max_order = 1"),
        ("draws = 1000", "draws = 200\nwarmup = 300\nchains = 2"),
        ("[confirm]\ndraws = 1", "[confirm]\ndraws = 0"),
    ];
    let results = results("steel-304l", &changes, dir.path());
    let summary = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    for name in ["offset (rates)", "matrix.plastic.hardening.voce.rate (bars)"] {
        assert!(summary.contains(&format!("\n{name},")), "{name}: {summary}");
    }
    // the posterior of the example: 237 ± 3.4 MPa and 0.0383 ± 0.0026
    for (parameter, low, high) in [
        ("matrix.plastic.yield_mpa", 225.0, 250.0),
        ("matrix.plastic.rate.johnson-cook.c", 0.03, 0.047),
        ("offset (rates)", 0.85, 1.1),
    ] {
        let [mean, sd] = posterior(&results, parameter);
        assert!((low..high).contains(&mean) && sd > 0.0, "{parameter}: {mean} ± {sd}");
    }
    // each test has the parameters that its runs depend on
    let columns = |test: &str| {
        let text = std::fs::read_to_string(results.join(format!("tests/{test}/runs.csv"))).unwrap();
        text.lines().find(|line| !line.starts_with('#')).unwrap().to_owned()
    };
    assert!(columns("bars").contains("saturation_mpa") && !columns("bars").contains("offset"));
    assert!(columns("rates").contains("offset") && !columns("rates").contains("saturation_mpa"));
}
