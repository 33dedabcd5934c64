//! Labels of the user: phases become regions, voids are omitted, and edited labels are used.

use std::collections::BTreeMap;
use std::path::Path;

use super::{breccia, table};

/// Number of voxels of 0.1 mm. The image has a cylinder with a radius of 1.5 mm and a height of 2.6 mm. Labels: matrix
/// 7, balls 1 and 2 (a ball of label 1 touches a ball of label 2), a pore 3, background 255.
const SHAPE: [usize; 3] = [40, 40, 34];
const VOXEL_MM: f64 = 0.1;

fn labels() -> fem::Volume<u32> {
    let values = (0..SHAPE.iter().product()).map(|n| {
        let [x, y, z] = [n % SHAPE[0], n / SHAPE[0] % SHAPE[1], n / (SHAPE[0] * SHAPE[1])]
            .map(|c| (c as f64 + 0.5) * VOXEL_MM);
        let ball =
            |at: [f64; 3], radius: f64| (x - at[0]).hypot(y - at[1]).hypot(z - at[2]) < radius;
        match () {
            () if (x - 2.0).hypot(y - 2.0) >= 1.5 || !(0.4..3.0).contains(&z) => 255,
            () if ball([1.5, 2.0, 1.1], 0.45) || ball([2.6, 2.5, 1.2], 0.4) => 1,
            () if ball([2.3, 2.0, 1.1], 0.4) || ball([2.0, 1.6, 2.3], 0.45) => 2,
            () if ball([1.6, 2.7, 2.2], 0.4) => 3,
            () => 7,
        }
    });
    fem::Volume::new(SHAPE, VOXEL_MM, values.collect()).unwrap()
}

const CASE: &str = r#"
[specimen]
spacing_mm = 0.4
grain_mode = "fraction"
order = 1
[specimen.image]
labels = "mine.tif"
background = 255
label_phases = { 1 = "grain", 2 = "inclusion", 3 = "void", 7 = "matrix" }
[material.matrix]
young_mpa = 275.0
poisson = 0.25
[material.grain]
young_mpa = 22000.0
poisson = 0.25
[material.inclusion]
young_mpa = 2000.0
poisson = 0.3
[test]
displacement_mm = 0.01
steps = 2
"#;

/// The values of a table `quantity,value`.
fn values(path: &Path) -> BTreeMap<String, f64> {
    table(path)
        .into_iter()
        .map(|row| (row["quantity"].clone(), row["value"].parse().unwrap()))
        .collect()
}

#[test]
fn own_labels_become_a_mesh_of_phases_and_a_simulation() {
    let dir = tempfile::tempdir().unwrap();
    let image = labels();
    fem::tiff::write_labels(&dir.path().join("mine.tif"), &image).unwrap();
    let run = |stage: &str, case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = breccia(dir.path(), &[stage, "case.toml", "--out", "out"]);
        (code, err)
    };
    let out = dir.path().join("out");
    for stage in ["segment", "mesh", "simulate"] {
        let (code, err) = run(stage, CASE);
        assert_eq!(code, Some(0), "{err}");
    }
    let mm3 = |label: u32| {
        image.values.iter().filter(|&&value| value == label).count() as f64 * VOXEL_MM.powi(3)
    };
    let found = values(&out.join("segment.csv"));
    assert!((found["radius_mm"] - 1.5).abs() < 0.02 && (found["height_mm"] - 2.6).abs() < 0.02);
    assert_eq!(found["grains"], 4.0);
    let cylinder = std::f64::consts::PI * found["radius_mm"].powi(2) * found["height_mm"];
    for (name, label) in [("grain", 1), ("inclusion", 2), ("void", 3)] {
        let fraction = found[&format!("fraction_{name}")];
        assert!((fraction * cylinder / mm3(label) - 1.0).abs() < 1e-3, "{name}: {fraction}");
    }
    let grains = table(&out.join("grains.csv"));
    let phases: Vec<&str> = grains.iter().map(|row| row["phase"].as_str()).collect();
    assert_eq!(phases, ["grain", "grain", "inclusion", "inclusion", "void"]);
    assert!(!out.join("solid.tif").exists());

    let mesh = values(&out.join("mesh.csv"));
    for (name, label, within) in [("grain", 1, 0.03), ("inclusion", 2, 0.03), ("void", 3, 0.05)] {
        let volume = mesh[&format!("volume_{name}_mm3")];
        assert!((volume / mm3(label) - 1.0).abs() < within, "{name}: {volume}, not {}", mm3(label));
    }
    assert!(mesh["multiphase_tets"] > 0.0 && mesh["void_tets"] > 0.0, "{mesh:?}");
    let warnings = std::fs::read_to_string(out.join("warnings/mesh.txt")).unwrap();
    assert!(warnings.contains("several phases besides the matrix"), "{warnings}");
    // the specimen is stiffer than the matrix alone and softer than with stiff inclusions
    let force = || {
        let curve = table(&out.join("curve.csv"));
        curve.last().unwrap()["force_N"].parse::<f64>().unwrap()
    };
    let soft = force();
    let (code, err) = run("simulate", &CASE.replace("young_mpa = 2000.0", "young_mpa = 22000.0"));
    assert_eq!(code, Some(0), "{err}");
    let matrix = 275.0 * std::f64::consts::PI * 1.5 * 1.5 * 0.01 / 2.6;
    assert!(matrix < soft && soft < force(), "{matrix} {soft} {}", force());
}

#[test]
fn edited_labels_are_used_and_never_given_up() {
    let dir = tempfile::tempdir().unwrap();
    fem::tiff::write_labels(&dir.path().join("mine.tif"), &labels()).unwrap();
    let run = |stage: &str, case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = breccia(dir.path(), &[stage, "case.toml", "--out", "out"]);
        (code, err)
    };
    let out = dir.path().join("out");
    for stage in ["segment", "mesh"] {
        let (code, err) = run(stage, CASE);
        assert_eq!(code, Some(0), "{err}");
    }
    let before = values(&out.join("mesh.csv"));
    let path = out.join("labels.tif");
    let mut edited = fem::tiff::read_labels(&path, None).unwrap();
    // the first grain is removed
    edited.values.iter_mut().filter(|label| **label == 1).for_each(|label| *label = 0);
    fem::tiff::write_labels(&path, &edited).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for stage in ["segment", "mesh"] {
        let (code, err) = run(stage, CASE);
        assert_eq!(code, Some(0), "{err}");
        assert!(err.contains("labels.tif was edited and is used as it is"), "{err}");
        assert!(!err.contains("--replace"), "{err}");
    }
    let after = values(&out.join("mesh.csv"));
    let column = "volume_grain_mm3";
    assert!(after[column] < 0.7 * before[column], "{} {}", after[column], before[column]);
    assert_eq!(after["grains"], 3.0);
    // a new grain has no phase; the suggested remedy does not discard the edit
    edited.values[0] = 99;
    fem::tiff::write_labels(&path, &edited).unwrap();
    let (code, err) = run("mesh", CASE);
    assert!(
        code == Some(1) && err.contains("the grain 99") && err.contains("specimen.image.labels"),
        "{err}"
    );
    assert!(!err.contains("--replace"), "{err}");
    // without that grain the edit is used again
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(run("mesh", CASE).0, Some(0));
}

#[test]
fn labels_without_a_phase_are_refused_by_their_values() {
    let dir = tempfile::tempdir().unwrap();
    fem::tiff::write_labels(&dir.path().join("mine.tif"), &labels()).unwrap();
    let case = CASE.replace(", 7 = \"matrix\"", "");
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["segment", "case.toml", "--out", "out"]);
    assert_eq!(code, Some(1));
    for part in ["case.toml", "labels without a phase: 7 (", "label_phases"] {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
}
