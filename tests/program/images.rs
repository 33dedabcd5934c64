//! From an image to labels, mesh and curve, through files that other programs can read.

use std::collections::BTreeMap;
use std::path::Path;

use fem::{Grain, GrainList, Scanner, Volume, tiff};

use super::{breccia, said};

const RADIUS: f64 = 1.2;
const HEIGHT: f64 = 2.0;
const VOXEL: f64 = 0.05;

/// Writes a 16-bit scan of four balls that are far apart; returns the balls.
fn scan(path: &Path) -> Vec<Grain> {
    let at = [[0.5, 0.1, 0.55], [-0.5, -0.2, 0.6], [0.1, -0.5, 1.4], [0.0, 0.55, 1.45]];
    let balls: Vec<Grain> = at.into_iter().map(|centre| Grain::sphere(centre, 0.35)).collect();
    let grains = GrainList::new(balls.clone(), RADIUS, HEIGHT);
    let scan = Scanner::new(VOXEL, 3).scan(RADIUS, HEIGHT, &grains).unwrap();
    let values = scan.grey.values.iter().map(|&grey| grey as u32).collect();
    let grey = Volume::new(scan.grey.shape, VOXEL, values).unwrap();
    tiff::write_labels(path, &grey).unwrap();
    balls
}

/// A case without prior and experiments, for `segment`, `mesh` and `simulate`.
const CASE: &str = r#"
[specimen]
spacing_mm = 0.35
order = 1
grain_mode = "conforming"
[specimen.image]
stack = "scan.tif"
[material.matrix]
young_mpa = 275.0
poisson = 0.25
[material.grain]
young_mpa = 22000.0
poisson = 0.25
[test]
displacement_mm = 0.02
steps = 1
[output]
fields_every = 0
"#;

fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// A table `quantity,value`.
fn quantities(path: &Path) -> BTreeMap<String, f64> {
    let rows = rows(path);
    assert_eq!(rows[0], ["quantity", "value"]);
    rows[1..].iter().map(|row| (row[0].clone(), row[1].parse().unwrap())).collect()
}

/// The user removes a grain by hand: the mesh is made from the edited labels.
#[test]
fn edited_labels_are_meshed_and_never_replaced() {
    let dir = tempfile::tempdir().unwrap();
    scan(&dir.path().join("scan.tif"));
    std::fs::write(dir.path().join("case.toml"), CASE).unwrap();
    let run = |command: &[&str]| {
        let command = [command, &["case.toml", "--out", "out"]].concat();
        let (code, _, err) = said(&breccia(dir.path(), &command));
        assert_eq!(code, Some(0), "{command:?}: {err}");
        err
    };
    let path = dir.path().join("out/labels.tif");
    let part = || quantities(&dir.path().join("out/mesh.csv"))["grain_fraction"];
    run(&["segment"]);
    run(&["mesh"]);
    let (whole, all) = (std::fs::read(&path).unwrap(), part());

    let mut labels = tiff::read_labels(&path, None).unwrap();
    labels.values.iter_mut().filter(|label| **label == 1).for_each(|label| *label = 0);
    tiff::write_labels(&path, &labels).unwrap();
    let edited = std::fs::read(&path).unwrap();
    for command in ["segment", "mesh"] {
        let err = run(&[command]);
        assert!(err.contains("labels.tif was edited and is used as it is"), "{command}: {err}");
    }
    // without grey values, the volume of a grain is the volume of its voxels
    let left = labels.values.iter().filter(|label| **label > 0).count() as f64;
    let whole_image = quantities(&dir.path().join("out/segment.csv"));
    let [radius, height] = ["radius_mm", "height_mm"].map(|name| whole_image[name]);
    let expected = left * VOXEL.powi(3) / (std::f64::consts::PI * radius * radius * height);
    assert!((part() / expected - 1.0).abs() < 0.03, "{} of {all}, not {expected}", part());
    assert!(part() < 0.85 * all, "one of four balls is gone");
    assert!(std::fs::read(&path).unwrap() == edited);

    run(&["segment", "--replace", "labels.tif"]);
    assert!(std::fs::read(&path).unwrap() == whole);
    run(&["mesh"]);
    assert!((part() / all - 1.0).abs() < 1e-9);
}

/// `segment` and `mesh` report the same grain fraction, namely the fraction of the meshed cylinder, also for a block
/// and for a cylinder that is cut out of the specimen.
#[test]
fn segment_and_mesh_report_the_same_grain_fraction() {
    let dir = tempfile::tempdir().unwrap();
    scan(&dir.path().join("scan.tif"));
    let whole = tiff::read_labels(&dir.path().join("scan.tif"), None).unwrap();
    // a block inside the specimen, with parts of all four balls
    let [nx, ny, nz] = whole.shape;
    let (low, high) = ([nx / 2 - 15, ny / 2 - 15, 8], [nx / 2 + 15, ny / 2 + 15, nz - 8]);
    let shape = [0, 1, 2].map(|k| high[k] - low[k]);
    let voxels = (0..shape.iter().product()).map(|n: usize| {
        let at = [n % shape[0], n / shape[0] % shape[1], n / (shape[0] * shape[1])];
        *whole.at([0, 1, 2].map(|k| low[k] + at[k]))
    });
    let block = Volume::new(shape, VOXEL, voxels.collect()).unwrap();
    tiff::write_labels(&dir.path().join("block.tif"), &block).unwrap();
    let block = CASE.replace("scan.tif", "block.tif");
    let smaller = CASE.replace("[specimen]", "[specimen]\nradius_mm = 0.8\nheight_mm = 1.6");
    for (name, case) in [("whole", CASE), ("block", &block), ("smaller", &smaller)] {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        for command in ["segment", "mesh"] {
            let arguments = [command, "case.toml", "--out", name];
            let (code, _, err) = said(&breccia(dir.path(), &arguments));
            assert_eq!(code, Some(0), "{name}, {command}: {err}");
            assert!(command == "mesh" || err.contains("% of the cylinder that is meshed"), "{err}");
        }
        let table = |file: &str| quantities(&dir.path().join(name).join(file));
        let (image, mesh) = (table("segment.csv"), table("mesh.csv"));
        let (found, asked) = (image["grain_fraction"], mesh["asked_grain_fraction"]);
        // labels.tif and solid.tif contain integers, which cause rounding errors
        assert!((found / asked - 1.0).abs() < 1e-3, "{name}: {found} and {asked}");
        let differs = (image["image_grain_fraction"] / found - 1.0).abs() > 0.1;
        assert_eq!(differs, name != "whole", "{name}: {image:?}");
    }
}

/// Labels of the user, and grey values, of a specimen that is smaller than the given size are refused: the volume outside
/// the image would be meshed as matrix.
#[test]
fn a_size_larger_than_the_specimen_in_the_image_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    scan(&dir.path().join("scan.tif"));
    let segment = |case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["segment", "case.toml", "--out", "out"]));
        (code, err)
    };
    let with_labels =
        CASE.replace("stack = \"scan.tif\"", "labels = \"labels.tif\"\nbackground = 9");
    // a cylinder of matrix with one ball: radius 16 voxels, height 24 voxels
    let voxels = (0..40_usize.pow(3)).map(|n| {
        let [x, y, z] = [n % 40, n / 40 % 40, n / 1600].map(|c| c as f64 - 19.5);
        let is_outside = x.hypot(y) > 16.0 || z.abs() > 12.0;
        if is_outside { 9 } else { u32::from(x.hypot(y).hypot(z) < 7.0) }
    });
    let labels = Volume::new([40; 3], VOXEL, voxels.collect()).unwrap();
    tiff::write_labels(&dir.path().join("labels.tif"), &labels).unwrap();
    for (case, radius, height) in [(CASE, RADIUS, HEIGHT), (with_labels.as_str(), 0.8, 1.2)] {
        for (size, key) in [
            (format!("radius_mm = {}", radius + 0.15), "specimen.radius_mm = "),
            (format!("height_mm = {}", height + 0.15), "specimen.height_mm = "),
        ] {
            let (code, err) = segment(&case.replace("[specimen]", &format!("[specimen]\n{size}")));
            let is_refused =
                err.contains(key) && err.contains("is larger than the specimen in the image");
            assert!(code == Some(1) && is_refused, "{err}");
        }
        let size = format!("[specimen]\nradius_mm = {radius}\nheight_mm = {height}");
        let (code, err) = segment(&case.replace("[specimen]", &size));
        assert_eq!(code, Some(0), "{err}");
    }
}

#[test]
fn an_image_becomes_labels_mesh_and_curve() {
    let dir = tempfile::tempdir().unwrap();
    let balls = scan(&dir.path().join("scan.tif"));
    std::fs::write(dir.path().join("case.toml"), CASE).unwrap();
    let run = |command: &str, out: &str| {
        let (code, text, err) = said(&breccia(dir.path(), &[command, "case.toml", "--out", out]));
        assert_eq!(code, Some(0), "{command}: {err}");
        text
    };
    let out = dir.path().join("out");
    run("segment", "out");
    let labels = tiff::read_labels(&out.join("labels.tif"), None).unwrap();
    let grey = tiff::read(&dir.path().join("scan.tif"), None).unwrap();
    assert_eq!((labels.shape, labels.voxel_mm), (grey.shape, grey.voxel_mm));
    let grains = rows(&out.join("grains.csv"));
    assert_eq!(grains[0][..5], ["id", "volume_mm3", "x_mm", "y_mm", "z_mm"]);
    assert_eq!(grains.len(), 1 + balls.len());
    let whole = quantities(&out.join("segment.csv"));
    let exact: f64 = balls.iter().map(Grain::volume_mm3).sum();
    let cylinder = std::f64::consts::PI * RADIUS * RADIUS * HEIGHT;
    for (name, expected, error) in [
        ("grains", 4.0, 0.0),
        ("grain_fraction", exact / cylinder, 0.03),
        ("radius_mm", RADIUS, 0.02),
        ("height_mm", HEIGHT, 0.02),
        ("voxel_mm", VOXEL, 1e-6),
    ] {
        let found = whole[name];
        assert!((found / expected - 1.0).abs() <= error, "{name}: {found}, not {expected}");
    }
    // every ball is found at its position: the origin of the specimen is the centre of the cylinder's bottom
    let corner = [whole["centre_x_mm"], whole["centre_y_mm"], whole["bottom_mm"]];
    for ball in &balls {
        let near = grains[1..].iter().filter(|row| {
            let place = [2, 3, 4].map(|k| row[k].parse::<f64>().unwrap() - corner[k - 2]);
            let off: f64 = (0..3).map(|k| (place[k] - ball.centre[k]).powi(2)).sum();
            let volume: f64 = row[1].parse().unwrap();
            off.sqrt() < 0.5 * VOXEL && (volume / ball.volume_mm3() - 1.0).abs() < 0.05
        });
        assert_eq!(near.count(), 1, "{:?} in {grains:?}", ball.centre);
    }

    run("mesh", "out");
    let mesh = quantities(&out.join("mesh.csv"));
    for name in ["dihedral_min_deg", "dihedral_p01_deg", "grain_fraction", "grains", "tets"] {
        assert!(mesh.contains_key(name), "{name} is not in {mesh:?}");
    }
    assert_eq!(mesh["grains"], 4.0);
    let (found, asked) = (mesh["grain_fraction"], whole["grain_fraction"]);
    // the edge length of an element is the radius of a ball, so that the mesh is coarse
    assert!((found / asked - 1.0).abs() < 0.015, "{found} of the mesh, {asked} of the image");
    assert!((found / (exact / cylinder) - 1.0).abs() < 0.015, "{found} of the mesh");
    assert!(mesh["dihedral_min_deg"] >= 12.0 - 1e-6, "{mesh:?}");
    for name in ["slices.png", "grains.png", "mesh.png"] {
        let bytes = std::fs::read(out.join(name)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 1000, "{name}");
    }
    for name in ["grain_sizes.svg", "mesh_quality.svg"] {
        assert!(std::fs::read_to_string(out.join(name)).unwrap().starts_with("<svg"), "{name}");
    }

    // the specimen is stiffer than the matrix alone and softer than Voigt's bound
    let curve = run("simulate", "out");
    let curve = rows(&dir.path().join(curve.trim()));
    let force: f64 = curve[1][2].parse().unwrap();
    let stiffness = |young: f64| young * cylinder / HEIGHT / HEIGHT * 0.02;
    let part = exact / cylinder;
    let voigt = stiffness(275.0 * (1.0 - part) + 22000.0 * part);
    assert!(force > 1.05 * stiffness(275.0) && force < voigt, "{force} N");
}

#[test]
fn images_that_cannot_be_used_are_refused_with_what_helps() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scan.tif");
    let segment = |case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["segment", "case.toml", "--out", "out"]));
        assert_eq!(code, Some(1), "{err}");
        err
    };
    let missing = segment(CASE);
    assert!(
        missing.contains("specimen.image.stack = scan.tif: there is no such file"),
        "{missing}"
    );
    std::fs::write(&path, b"II*\0 a photograph").unwrap();
    let broken = segment(CASE);
    assert!(broken.contains("scan.tif"), "{broken}");
    let flat = Volume::new([12, 12, 12], VOXEL, vec![7; 1728]).unwrap();
    tiff::write_labels(&path, &flat).unwrap();
    let flat = segment(CASE);
    assert!(flat.contains("case.toml: specimen.image"), "{flat}");
    scan(&path);
    let mesh = breccia(dir.path(), &["mesh", "case.toml", "--out", "new"]);
    let (code, _, err) = said(&mesh);
    assert!(code == Some(1) && err.contains("`breccia segment` first"), "{err}");
}
