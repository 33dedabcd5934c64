//! Calibrations with `[conditions]`: triaxial compression.

use std::path::Path;

use super::{breccia, number, table};

/// A cylinder as a lattice of linear elements.
const LATTICE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.5\norder = 1\n";

/// A case of 12 runs and four virtual specimens. `truth` is the value of the calibrated parameter of the virtual specimens.
fn case(
    specimen: &str,
    material: &str,
    test: &str,
    quantities: &str,
    [prior, truth]: [&str; 2],
) -> String {
    format!(
        r#"
{specimen}
[material.matrix]
young_mpa = 275.0
poisson = 0.25
{material}
[test]
{test}
[qoi]
quantities = [{quantities}]
[prior]
{prior}
[design]
runs = 12
[surrogate]
max_order = 3
[experiments.virtual]
specimens = 4
seed = 5
truth = {{ {truth} }}
noise = {{ force_n = 0.05, displacement_mm = 0.00002 }}
[calibration]
chains = 2
warmup = 200
draws = 300
[confirm]
draws = 1
"#
    )
}

/// Checks a case, runs it to the report, and returns mean and standard deviation of the first parameter. `printed` must be
/// among the lines that `breccia check` prints.
fn calibrated(dir: &Path, text: &str, printed: &str) -> [f64; 2] {
    std::fs::write(dir.join("case.toml"), text).unwrap();
    let (code, out, err) = breccia(dir, &["check", "case.toml"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(format!("{out}{err}").contains(printed), "{printed:?} is not in {out}{err}");
    let (code, out, err) = breccia(dir, &["run", "case.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(dir.join("results/report.html").is_file());
    let summary = table(&dir.join("results/summary.csv"));
    ["mean", "sd"].map(|column| number(&summary[0], column))
}

/// The wall of a cylinder has a pressure, which acts before the axial compression.
#[test]
fn triaxial_compression_is_calibrated() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("axial.csv"), "time_s,factor\n1.0,0.0\n2.0,1.0\n").unwrap();
    let test = r#"
duration_s = 2.0
steps = 10
[conditions]
remove_rigid_motions = true
pressure = [{ surface = "side", pressure_mpa = 2.0, table = [[1.0, 1.0]] }]
prescribe = [
  { surface = "bottom", z_mm = 0.0 },
  { surface = "top", z_mm = -0.1, table = "axial.csv" },
]
measure = { surface = "top", direction = [0.0, 0.0, -1.0] }
"#;
    let young = ["matrix.young_mpa = [220.0, 340.0]", "matrix.young_mpa = 275.0"];
    let text = case(LATTICE, "", test, r#""force-at-1.5-s", "force-at-2-s""#, young);
    let [mean, sd] = calibrated(dir.path(), &text, "force_at_1.5_s_N");
    assert!(sd < 20.0 && (mean - 275.0).abs() < 4.0 * sd, "{mean} ± {sd}");
    let area = std::f64::consts::PI * 2.5 * 2.5;
    for row in table(&dir.path().join("results/runs.csv")) {
        // axial compression adds E ε; half of it follows after 1.5 s
        let strain = 0.05 / 4.4;
        let added = number(&row, "force_at_2_s_N") - number(&row, "force_at_1.5_s_N");
        let exact = number(&row, "matrix.young_mpa") * strain * area;
        assert!((added / exact - 1.0).abs() < 0.15, "{row:?} {exact}");
    }
}
