//! Calibrations with `[conditions]`: triaxial compression, and tension of a bar with an extensometer.

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

/// A round bar that is stretched along its axis. The extensometer measures half of its length.
const BAR: &str = r#"
[specimen]
mesh = "bar.msh"
order = 1
regions = { matrix = "matrix" }
surfaces = { bottom = "bottom", top = "top" }
"#;
const TENSION: &str = r#"
steps = 5
[conditions]
symmetry = ["bottom"]
remove_rigid_motions = true
prescribe = [{ surface = "top", z_mm = 0.2 }]
measure = { surface = "top", direction = [0.0, 0.0, 1.0] }
extensometer = { from_mm = [0.0, 0.0, 4.4], to_mm = [0.0, 0.0, 13.2] }
"#;

/// A mesh file has virtual specimens, which share its mesh. Hencky's law in uniaxial tension has the force E A ln λ / λ.
#[test]
fn a_bar_with_an_extensometer_is_calibrated_on_a_mesh_file() {
    let dir = tempfile::tempdir().unwrap();
    let cylinder = fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
    let mut mesh = cylinder.build().unwrap();
    mesh.nodes.iter_mut().for_each(|node| node[2] *= 4.0);
    fem::gmsh::write(dir.path().join("bar.msh"), &mesh).unwrap();
    let area_mm2 = mesh.volume() / 17.6;
    let stretch = 1.0 + 0.08 / 8.8_f64;
    let force_n = |young_mpa: f64| young_mpa * area_mm2 * stretch.ln() / stretch;

    let young = ["matrix.young_mpa = [220.0, 340.0]", "matrix.young_mpa = 275.0"];
    let text = case(BAR, "", TENSION, r#""force-at-0.08-mm""#, young)
        .replace("noise =", "scatter = { matrix.young_mpa = 0.03 }\nnoise =");
    let [mean, sd] = calibrated(dir.path(), &text, "bar.msh");
    let results = dir.path().join("results");
    let column = "force_at_0.08_mm_N";
    for row in table(&results.join("runs.csv")) {
        let exact = force_n(number(&row, "matrix.young_mpa"));
        assert!((number(&row, column) / exact - 1.0).abs() < 1e-6, "{row:?} {exact}");
    }
    let specimens = table(&results.join("experiments.csv"));
    let truths = table(&results.join("experiments/truth.csv"));
    assert_eq!(specimens.len(), 4);
    let mut measured = 0.0;
    for (specimen, truth) in specimens.iter().zip(&truths) {
        // noise of 0.05 N and 0.02 µm is below 0.1 % of the force
        let exact = force_n(number(truth, "matrix.young_mpa"));
        assert!((number(specimen, column) / exact - 1.0).abs() < 2e-3, "{specimen:?} {exact}");
        measured += number(specimen, column) / 4.0;
    }
    // the posterior is centred at the modulus of the mean force
    let centre = measured / force_n(1.0);
    assert!((mean - centre).abs() < 0.5 * sd, "{mean} ± {sd}, {centre}");
    assert!((mean - 275.0).abs() < 4.0 * sd && sd < 15.0, "{mean} ± {sd}");

    // keys of properties that a shared mesh does not have are refused
    let with = |key: &str| {
        let text = text.replace("seed = 5", &format!("seed = 5\n{key}"));
        std::fs::write(dir.path().join("refused.toml"), text).unwrap();
        let (code, out, err) = breccia(dir.path(), &["check", "refused.toml"]);
        assert_ne!(code, Some(0), "{key}");
        format!("{out}{err}")
    };
    assert!(
        with("spacing_mm = 1.0")
            .contains("cannot change the elements of a block or of specimen.mesh")
    );
    assert!(with("scans = true").contains("experiments.virtual.scans"));
}
