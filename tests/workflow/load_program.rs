//! A load program with hold and unloading, from the runs to the posterior: no quantity needs a peak.

use std::path::Path;

use super::{breccia, edit, number, table};

/// Linear elements, 12 runs, four virtual specimens. The machine of the virtual specimens is compliant.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[phase_field]
length_mm = 0.06
[test]
program = [
  { time_s = 0.1, displacement_mm = 0.08, steps = 20 },
  { time_s = 1.1, displacement_mm = 0.08 },
  { time_s = 1.2, displacement_mm = 0.02 },
]
steps = 25
[machine]
compliance_mm_per_n = 1e-5
force_offset_n = 0.7
[qoi]
quantities = ["force-at-0.1-s", "relaxed-fraction", "unloading-slope", "hysteresis-energy"]
[prior]
matrix.young_mpa = [220.0, 340.0]
matrix.viscosity_mpa_s = [0.1, 0.6]
[design]
runs = 16
[surrogate]
max_order = 3
[experiments.virtual]
specimens = 4
seed = 5
truth = { matrix.young_mpa = 275.0, matrix.viscosity_mpa_s = 0.3 }
noise = { force_n = 0.05, displacement_mm = 0.00002 }
[calibration]
chains = 2
warmup = 200
draws = 300
[confirm]
draws = 1
"#;

const COLUMNS: [&str; 4] =
    ["force_at_0.1_s_N", "relaxed_fraction", "unloading_slope_N_per_mm", "hysteresis_energy_N_mm"];

/// The four quantities of a run from its readings by simple rules: force at the corner, forces at both ends of the hold,
/// the secant of the first half of unloading, and the trapezoidal rule.
fn by_hand(path: &Path) -> [f64; 4] {
    let rows = table(path);
    let column = |name: &str| rows.iter().map(|row| number(row, name)).collect::<Vec<f64>>();
    let [t, u, f] = ["time_s", "displacement_mm", "force_N"].map(column);
    assert_eq!(rows.len(), 20 + 25 + 25);
    let at = |time_s: f64| t.iter().position(|t| (t - time_s).abs() < 1e-9).expect("a corner");
    let [start, end] = [at(0.1), at(1.1)];
    assert!(u[start..=end].iter().all(|u| (u - 0.08).abs() < 1e-12), "a hold");
    let half = (end..u.len())
        .min_by(|&a, &b| (u[a] - 0.05).abs().total_cmp(&(u[b] - 0.05).abs()))
        .unwrap();
    let slope = (f[end] - f[half]) / (u[end] - u[half]);
    let mut work = 0.5 * u[0] * f[0];
    work += (1..u.len()).map(|i| 0.5 * (f[i] + f[i - 1]) * (u[i] - u[i - 1])).sum::<f64>();
    [f[start], 1.0 - f[end] / f[start], slope, work]
}

#[test]
fn a_load_program_is_calibrated_from_quantities_of_its_branches() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), CASE).unwrap();
    let (code, printed, err) = breccia(dir.path(), &["check", "case.toml"]);
    assert_eq!(code, Some(0), "{err}");
    let program = "load program: 0.08 mm at 0.1 s in 20 steps, 0.08 mm at 1.1 s in 25 steps";
    assert!(format!("{printed}{err}").contains(program), "{printed}{err}");
    let (code, _, err) = breccia(dir.path(), &["run", "case.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");

    let runs = table(&results.join("runs.csv"));
    assert_eq!(runs.len(), 16);
    for row in &runs {
        let exact = by_hand(&results.join(format!("curves/run-{:0>3}.csv", row["run"])));
        let within = [1e-9, 1e-3, 0.02, 1e-9];
        for ((column, exact), within) in COLUMNS.iter().zip(exact).zip(within) {
            let found = number(row, column);
            assert!((found / exact - 1.0).abs() < within, "{column}: {found} {exact} {row:?}");
        }
    }

    // the curves of the virtual specimens have times, and the quantities do not contain the compliance
    // of the machine
    let curve = std::fs::read_to_string(results.join("experiments/curves/V-01.csv")).unwrap();
    assert!(curve.starts_with("time_s,displacement_mm,force_N\n"), "{curve}");
    let checks = table(&results.join("curve_checks.csv"));
    let machine: Vec<_> = checks.iter().filter(|row| row["finding"] == "machine").collect();
    assert_eq!(machine.len(), 4, "{checks:?}");
    let specimens = table(&results.join("experiments.csv"));
    let mean = |rows: &[std::collections::BTreeMap<String, String>], column: &str| {
        rows.iter().map(|row| number(row, column)).sum::<f64>() / rows.len() as f64
    };
    for column in COLUMNS {
        let [low, high] = runs
            .iter()
            .map(|row| number(row, column))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)]);
        assert!((low..high).contains(&mean(&specimens, column)), "{column}: {specimens:?}");
    }

    let summary = table(&results.join("summary.csv"));
    for (parameter, truth, most_sd) in
        [("matrix.young_mpa", 275.0, 20.0), ("matrix.viscosity_mpa_s", 0.3, 0.08)]
    {
        let row = summary.iter().find(|row| row["parameter"] == parameter).unwrap();
        let (mean, sd) = (number(row, "mean"), number(row, "sd"));
        assert!(sd < most_sd && (mean - truth).abs() < 4.0 * sd, "{parameter}: {mean} ± {sd}");
    }
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in ["relaxed fraction", "hysteresis energy (N mm)", "force at 0.1 s (N)"] {
        assert!(page.contains(part), "{part}");
    }

    // measured curves without times, and curves of another program, are refused
    let measured = CASE.replace(
        "[experiments.virtual]",
        "[experiments]\ntable = \"lab/specimens.csv\"\n[ignored]",
    );
    let measured = measured.split("[ignored]").next().unwrap().to_owned();
    std::fs::write(dir.path().join("measured.toml"), measured).unwrap();
    let lab = dir.path().join("lab");
    std::fs::create_dir_all(lab.join("curves")).unwrap();
    std::fs::copy(results.join("experiments/specimens.csv"), lab.join("specimens.csv")).unwrap();
    for k in 1..=4 {
        let name = format!("curves/V-{k:02}.csv");
        std::fs::copy(results.join("experiments").join(&name), lab.join(&name)).unwrap();
    }
    let check = || breccia(dir.path(), &["check", "measured.toml"]);
    let (code, printed, err) = check();
    assert_eq!(code, Some(0), "{printed}{err}");
    let curve = lab.join("curves/V-02.csv");
    let whole = std::fs::read_to_string(&curve).unwrap();
    edit(&curve, |text| {
        let lines = text.lines().map(|line| line.split_once(',').unwrap().1);
        lines.collect::<Vec<_>>().join("\n")
    });
    let (code, printed, err) = check();
    assert_ne!(code, Some(0));
    assert!(format!("{printed}{err}").contains("no column time_s"), "{printed}{err}");
    std::fs::write(&curve, whole).unwrap();
    edit(&dir.path().join("measured.toml"), |text| text.replace("time_s = 1.1", "time_s = 1.15"));
    let (code, printed, err) = check();
    assert_ne!(code, Some(0));
    assert!(format!("{printed}{err}").contains("test.program states"), "{printed}{err}");
}

/// The case at constant speed, with a machine whose compliance is unknown. The compliance of the machine is at most a
/// third of the compliance of the specimen.
fn compliant() -> String {
    let start = CASE.find("[test]").unwrap();
    let end = CASE.find("[prior]").unwrap();
    let test = "[test]\ndisplacement_mm = 0.22\nsteps = 44\nstop_below_peak = 0.1\n[machine]\nforce_offset_n = 0.7\n";
    format!("{}{test}{}", &CASE[..start], &CASE[end..])
        .replace("[design]", "machine.compliance_mm_per_n = [0.0, 3e-4]\n[design]")
        .replace(
            "matrix.viscosity_mpa_s = 0.3 }",
            "matrix.viscosity_mpa_s = 0.3, machine.compliance_mm_per_n = 1e-4 }",
        )
        .replace("runs = 16", "runs = 24")
}

#[test]
fn an_unknown_compliance_is_a_nuisance_parameter() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), compliant()).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "case.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");
    let runs = table(&results.join("runs.csv"));
    assert_eq!(runs.len(), 24);
    for row in &runs {
        let curve = table(&results.join(format!("curves/run-{:0>3}.csv", row["run"])));
        let column = |name: &str| curve.iter().map(|row| number(row, name)).collect::<Vec<f64>>();
        let [u, f] = ["displacement_mm", "force_N"].map(column);
        let top = (0..f.len()).max_by(|&a, &b| f[a].total_cmp(&f[b])).unwrap();
        // the files have the curves of the specimens; the machine adds C F to the displacement, and leaves the force
        let compliance = number(row, "machine.compliance_mm_per_n");
        let recorded = u[top] + compliance * f[top];
        let found = number(row, "displacement_at_peak_mm");
        assert!((found / recorded - 1.0).abs() < 0.03, "{found} {recorded} {row:?}");
        assert!((number(row, "peak_force_N") / f[top] - 1.0).abs() < 0.01, "{row:?}");
    }
    let summary = table(&results.join("summary.csv"));
    for (parameter, truth) in [
        ("matrix.young_mpa", 275.0),
        ("matrix.viscosity_mpa_s", 0.3),
        ("machine.compliance_mm_per_n", 1e-4),
    ] {
        let row = summary.iter().find(|row| row["parameter"] == parameter).unwrap();
        let (mean, sd) = (number(row, "mean"), number(row, "sd"));
        assert!((mean - truth).abs() < 4.0 * sd, "{parameter}: {mean} ± {sd}");
    }
    // the force offset is a known number: the curves of the specimens are corrected by this offset, but
    // not by the compliance
    let checks = table(&results.join("curve_checks.csv"));
    let machine: Vec<_> = checks.iter().filter(|row| row["finding"] == "machine").collect();
    assert_eq!(machine.len(), 4, "{checks:?}");
    assert!(machine.iter().all(|row| number(row, "value") == 0.0), "{machine:?}");
    // derivatives with respect to the machine do not exist
    let text = compliant().replace("runs = 24", "runs = 24\nderivatives = true");
    std::fs::write(dir.path().join("derivatives.toml"), text).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "derivatives.toml", "--out", "derivatives"]);
    assert_ne!(code, Some(0));
    for part in ["machine.compliance_mm_per_n", "not a constant of a material"] {
        assert!(err.contains(part), "{part:?} is not in {err}");
    }
}
