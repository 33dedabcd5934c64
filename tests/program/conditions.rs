//! Compares bodies without platens, whose boundary conditions are stated by name, with closed forms.

use std::collections::BTreeMap;
use std::path::Path;

use fem::TetMesh;

use super::{breccia, said};

/// The unit cube as six tetrahedra; the sides are named after the axes.
fn cube() -> TetMesh {
    let corner = |c: u32| [c & 1, c >> 1 & 1, c >> 2].map(f64::from);
    let tets: Vec<[u32; 4]> =
        [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]].map(|[a, b]| [0, a, b, 7]).to_vec();
    let nodes: Vec<_> = (0..8).map(corner).collect();
    let mut surfaces: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
    for (axis, names) in [["x0", "x1"], ["y0", "y1"], ["z0", "z1"]].iter().enumerate() {
        for (level, name) in names.iter().enumerate() {
            let on = |n: &u32| nodes[*n as usize][axis] == level as f64;
            let faces = tets
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, c, b], [a, b, d], [b, c, d], [a, d, c]].into_iter());
            let faces = faces.filter(|face| face.iter().all(on)).collect();
            surfaces.insert((*name).into(), faces);
        }
    }
    let region_of = vec![0; tets.len()];
    TetMesh {
        nodes,
        tets,
        region_of,
        regions: vec!["rubber".into()],
        surfaces,
        ..TetMesh::default()
    }
}

/// The rows of a curve file.
fn curve(path: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    text.lines().skip(1).map(numbers).collect()
}

const RUBBER: [f64; 3] = [0.16, 0.03, 2.0];
const TOUGHNESS: f64 = 0.02;
const LENGTH: f64 = 0.5;
const RESIDUAL: f64 = 0.01;

/// The cube of Mooney–Rivlin rubber with damage that does not degrade the energy of compression, stretched along x and
/// held along y and z.
fn stretched(order: u8, displacement: f64) -> String {
    let [c10, c01, bulk] = RUBBER;
    format!(
        r#"
[specimen]
mesh = "cube.msh"
order = {order}
regions = {{ rubber = "rubber" }}
surfaces = {{ x0 = "x0", x1 = "x1", y0 = "y0", y1 = "y1", z0 = "z0", z1 = "z1" }}
[material.rubber]
law = {{ mooney-rivlin = {{ c10_mpa = {c10}, c01_mpa = {c01}, bulk_mpa = {bulk} }} }}
toughness_n_per_mm = {TOUGHNESS}
residual_stiffness = {RESIDUAL}
[phase_field]
split = "volumetric-deviatoric"
length_mm = {LENGTH}
[test]
steps = 5
[conditions]
symmetry = ["x0", "y0", "y1", "z0", "z1"]
prescribe = [{{ surface = "x1", x_mm = {displacement} }}]
measure = {{ surface = "x1", direction = [1, 0, 0] }}
[output]
checkpoint_every = 2
"#
    )
}

/// Force and damage of the cube at the stretch λ. The energy is ψ = C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3) + U(J) with J = λ.
/// Damage is driven by ψ if J > 1 and by ψ − U otherwise.
fn closed_form(stretch: f64) -> [f64; 2] {
    let [c10, c01, bulk] = RUBBER;
    let x = stretch;
    let first = x.powf(4.0 / 3.0) + 2.0 * x.powf(-2.0 / 3.0);
    let second = 2.0 * x.powf(2.0 / 3.0) + x.powf(-4.0 / 3.0);
    let shape = c10 * (first - 3.0) + c01 * (second - 3.0);
    let shape_force = c10 * 4.0 / 3.0 * (x.cbrt() - x.powf(-5.0 / 3.0))
        + c01 * 4.0 / 3.0 * (x.powf(-1.0 / 3.0) - x.powf(-7.0 / 3.0));
    let volume = 0.25 * bulk * (x * x - 1.0 - 2.0 * x.ln());
    let volume_force = 0.5 * bulk * (x - 1.0 / x);
    let spared = x < 1.0;
    let drive = 2.0 * (1.0 - RESIDUAL) * if spared { shape } else { shape + volume };
    let damage = drive / (drive + TOUGHNESS / LENGTH);
    let g = (1.0 - RESIDUAL) * (1.0 - damage).powi(2) + RESIDUAL;
    let force =
        if spared { g * shape_force + volume_force } else { g * (shape_force + volume_force) };
    [force, damage]
}

#[test]
fn a_cube_of_rubber_is_damaged_as_its_split_says() {
    let dir = tempfile::tempdir().unwrap();
    fem::gmsh::write(dir.path().join("cube.msh"), &cube()).unwrap();
    for (order, displacement) in [(1, 0.4), (1, -0.4), (2, -0.4)] {
        std::fs::write(dir.path().join("case.toml"), stretched(order, displacement)).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
        assert_eq!(code, Some(0), "{err}");
        let curve = curve(&dir.path().join("out/curve.csv"));
        assert_eq!(curve.len(), 5);
        for (i, row) in curve.iter().enumerate() {
            let moved = displacement * (i + 1) as f64 / 5.0;
            let [force, damage] = closed_form(1.0 + moved);
            assert!((row[1] - moved).abs() < 1e-12, "{row:?}");
            assert!((row[2] - force).abs() < 1e-6 * force.abs(), "{force} N: {row:?}");
            assert!((row[7] - damage).abs() < 1e-6, "φ = {damage}: {row:?}");
        }
        let least = curve.last().unwrap()[7];
        assert!(least > 0.3, "damage matters in this test: {least}");
    }
}

/// Regression: if a body moves against the direction in which its force is measured, the force is negative. A negative
/// force is below any fraction of a positive peak and must not stop the run.
#[test]
fn stop_below_peak_looks_at_the_size_of_the_force() {
    let dir = tempfile::tempdir().unwrap();
    fem::gmsh::write(dir.path().join("cube.msh"), &cube()).unwrap();
    let case = stretched(1, -0.4).replace("steps = 5", "steps = 5\nstop_below_peak = 0.9");
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
    assert_eq!(code, Some(0), "{err}");
    let curve = curve(&dir.path().join("out/curve.csv"));
    assert!(curve.iter().all(|row| row[2] < 0.0), "{curve:?}");
    assert_eq!(curve.len(), 5);
}

#[test]
fn a_cylinder_under_a_dead_load_shortens_as_its_law_says() {
    let dir = tempfile::tempdir().unwrap();
    // a quadratic mesh has curved walls, so that its volume agrees with the volume of a cylinder to a few thousandths
    let case = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 2
[material.matrix]
young_mpa = 275.0
poisson = 0.25
[test]
steps = 3
[conditions]
symmetry = ["bottom"]
traction = [{ surface = "top", vector_mpa = [0.0, 0.0, -30.0] }]
remove_rigid_motions = true
measure = { surface = "top", direction = [0.0, 0.0, -1.0] }
"#;
    let simulate = |case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]))
    };
    let (code, _, err) = simulate(case);
    assert_eq!(code, Some(0), "{err}");
    // −E ln λ/λ is the nominal stress
    for (i, row) in curve(&dir.path().join("out/curve.csv")).iter().enumerate() {
        let stretch = 1.0 - row[1] / 4.4;
        let stress = -275.0 * stretch.ln() / stretch;
        let load = 10.0 * (i + 1) as f64;
        assert!((stress - load).abs() < 5e-3 * load, "{stress} MPa: {row:?}");
    }
    for (from, to, parts) in [
        ("\"bottom\"", "\"foot\"", ["= foot: is not a surface", "the surfaces bottom, side, top"]),
        ("remove_rigid_motions = true\n", "", ["rigid motions are free", "remove_rigid_motions"]),
        ("symmetry = [\"bottom\"]", "symmetry = [\"side\"]", ["'side'", "not a plane"]),
    ] {
        let simulated = simulate(&case.replace(from, to));
        // `breccia check`, which reads no mesh, reports the same mistakes as the simulation
        let checked = said(&breccia(dir.path(), &["check", "case.toml"]));
        for (code, _, err) in [simulated, checked] {
            assert_eq!(code, Some(1), "{err}");
            for part in ["case.toml"].iter().chain(&parts) {
                assert!(err.contains(part), "{part:?} is not in {err:?}");
            }
        }
    }
}

/// The example of `docs/how-to/conditions.md` with measured curves, which have a force at the displacement zero. The
/// check reports this force neither as a spike nor as a toe.
#[test]
fn curves_of_triaxial_compression_are_checked_from_the_end_of_the_confinement() {
    let dir = tempfile::tempdir().unwrap();
    let page = include_str!("../../docs/how-to/conditions.md");
    let example = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let case = format!(
        r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.4
order = 1
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[phase_field]
length_mm = 0.06
[prior]
matrix.young_mpa = [230.0, 330.0]
[design]
microstructure = "one"
[experiments]
table = "specimens.csv"
{example}"#
    );
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    write("case.toml", &case);
    std::fs::create_dir(dir.path().join("curves")).unwrap();
    let mut specimens = "id,height_mm,radius_mm,group\n".to_owned();
    for (k, factor) in [0.96, 1.0, 1.03].into_iter().enumerate() {
        specimens += &format!("T-{k},4.4,2.5,A\n");
        let mut curve = "time_s,displacement_mm,force_N\n".to_owned();
        for i in 0..=100 {
            let t = 0.1 * f64::from(i);
            let x = 0.6 * (t - 1.0);
            // the force falls at the end of the confinement
            let force_n = factor
                * match t {
                    t if t < 0.95 => 4.0 * t,
                    t if t < 1.05 => 3.0,
                    _ => 3.0 + 30.0 * x * ((1.0 - x.powi(3)) / 3.0).exp(),
                };
            curve += &format!("{t},{},{force_n}\n", (t - 1.0).max(0.0) / 30.0);
        }
        write(&format!("curves/T-{k}.csv"), &curve);
    }
    write("specimens.csv", &specimens);
    let (code, out, err) = said(&breccia(dir.path(), &["check", "case.toml"]));
    assert_eq!(code, Some(0), "{out}{err}");
    for part in ["pressure 0.5 MPa", "3 readable in specimens.csv", "force_at_1_s_N: mean "] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    for part in ["spike", "single reading", "begins to carry load", "toe"] {
        assert!(!out.contains(part), "{part:?} is in {out}");
    }
    write("case.toml", &case.replace("specimens.csv\"", "specimens.csv\"\ntoe = \"correct\""));
    let (code, _, err) = said(&breccia(dir.path(), &["check", "case.toml"]));
    assert!(code == Some(1) && err.contains("experiments.toe"), "{err}");

    // surfaces and gauge points that a cylinder does not have
    for (from, to, part) in [
        ("surface = \"side\"", "surface = \"sides\"", "Did you mean \"side\"?"),
        (
            "remove_rigid_motions = true",
            "remove_rigid_motions = true\nextensometer = { from_mm = [0, 0, 1], to_mm = [0, 0, 5] }",
            "conditions.extensometer.to_mm = [0.0, 0.0, 5.0]: lies outside the specimen",
        ),
    ] {
        assert!(case.contains(from), "{from}");
        write("case.toml", &case.replacen(from, to, 1));
        let (code, _, err) = said(&breccia(dir.path(), &["check", "case.toml"]));
        assert!(code == Some(1) && err.contains(part), "{part:?} is not in {err}");
    }
}
