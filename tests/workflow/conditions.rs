//! Calibrations with `[conditions]` (triaxial compression, tension of a mesh file with an extensometer) and with a
//! prescribed force (creep).

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
    let text = case(LATTICE, "", test, r#""force-at-1-s", "force-at-2-s""#, young);
    let [mean, sd] = calibrated(dir.path(), &text, "force_at_1_s_N");
    assert!(sd < 20.0 && (mean - 275.0).abs() < 4.0 * sd, "{mean} ± {sd}");
    let area = std::f64::consts::PI * 2.5 * 2.5;
    for row in table(&dir.path().join("results/runs.csv")) {
        // the top is held while the pressure p rises: the axial stress is 2 ν p for any Young's modulus
        let held = number(&row, "force_at_1_s_N") / (2.0 * 0.25 * 2.0 * area);
        assert!((held - 1.0).abs() < 0.1, "{row:?}");
        // axial compression adds E ε
        let strain = 0.1 / 4.4;
        let added = number(&row, "force_at_2_s_N") - number(&row, "force_at_1_s_N");
        let exact = number(&row, "matrix.young_mpa") * strain * area;
        assert!((added / exact - 1.0).abs() < 0.15, "{row:?} {exact}");
    }
}

/// A bar from a mesh file is pulled; an extensometer measures the middle half of its length.
#[test]
fn tension_of_a_mesh_file_is_calibrated_with_an_extensometer() {
    let dir = tempfile::tempdir().unwrap();
    let mut mesh = fem::Block::new([2.0, 2.0, 8.0], [2, 2, 6]).build().unwrap();
    mesh.regions = vec!["matrix".into()];
    fem::gmsh::write(dir.path().join("bar.msh"), &mesh).unwrap();
    let specimen = r#"[specimen]
mesh = "bar.msh"
regions = { matrix = "matrix" }
surfaces = { bottom = "bottom", top = "top", left = "left", front = "front" }
order = 1
"#;
    let test = r#"
steps = 8
[conditions]
symmetry = ["left", "front", "bottom"]
prescribe = [{ surface = "top", z_mm = 0.16 }]
measure = { surface = "top", direction = [0.0, 0.0, 1.0] }
extensometer = { from_mm = [0.9, 0.9, 2.0], to_mm = [0.9, 0.9, 6.0] }
"#;
    let young = ["matrix.young_mpa = [220.0, 340.0]", "matrix.young_mpa = 275.0"];
    let quantities = r#""force-at-0.05-mm", "displacement-at-1-s""#;
    let text = case(specimen, "", test, quantities, young);
    let [mean, sd] = calibrated(dir.path(), &text, "displacement_at_1_s_mm");
    assert!(sd < 20.0 && (mean - 275.0).abs() < 4.0 * sd, "{mean} ± {sd}");
    for row in table(&dir.path().join("results/runs.csv")) {
        // half of the length has half of the elongation of 0.16 mm
        assert!((number(&row, "displacement_at_1_s_mm") - 0.08).abs() < 1e-5, "{row:?}");
        let strain = 0.05 / 4.0;
        let exact = number(&row, "matrix.young_mpa") * strain * 4.0;
        assert!((number(&row, "force_at_0.05_mm_N") / exact - 1.0).abs() < 0.03, "{row:?}");
    }
}

/// A creep test identifies the viscous fraction of the shear modulus.
#[test]
fn creep_under_a_prescribed_force_is_calibrated() {
    let dir = tempfile::tempdir().unwrap();
    let material = "viscoelastic = { shear = [{ fraction = 0.4, time_s = 0.5 }] }";
    let test = r#"
program = [
  { time_s = 0.1, force_n = 80.0, steps = 5 },
  { time_s = 3.0, force_n = 80.0 },
]
steps = 20
"#;
    let quantities = r#""displacement-at-0.1-s", "creep-displacement", "displacement-at-1-s""#;
    let young = ["matrix.young_mpa = [220.0, 340.0]", "matrix.young_mpa = 275.0"];
    let text = case(LATTICE, material, test, quantities, young);
    let [mean, sd] = calibrated(dir.path(), &text, "80 N at 0.1 s in 5 steps, 80 N at 3 s");
    assert!(sd < 20.0 && (mean - 275.0).abs() < 4.0 * sd, "{mean} ± {sd}");
    for row in table(&dir.path().join("results/runs.csv")) {
        let curve = table(&dir.path().join(format!("results/curves/run-{:0>3}.csv", row["run"])));
        assert!(
            curve.iter().skip(4).all(|p| (number(p, "force_N") - 80.0).abs() < 1e-4),
            "{row:?}"
        );
        let at = |k: usize| number(&curve[k], "displacement_mm");
        let gained = at(curve.len() - 1) - at(4);
        let found = number(&row, "creep_displacement_mm");
        assert!(gained > 0.0 && (found / gained - 1.0).abs() < 1e-3, "{found} {gained}");
    }
}
