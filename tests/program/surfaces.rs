//! STL files of grains, written and read by the program: packing → STL → mesh → simulation.

use std::path::Path;

use fem::stl;

use super::{breccia, said};

const PACKING: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.6\norder = 1\n\
    grains = { fraction = 0.15, seed = 2, film_mm = 0.1 }\n";
const REST: &str = "[material.matrix]\nyoung_mpa = 275.0\npoisson = 0.25\n\
    [material.grain]\nyoung_mpa = 22000.0\npoisson = 0.25\n[test]\ndisplacement_mm = 0.022\nsteps = 1\n";

fn surfaces_case(stl: &str) -> String {
    format!("[specimen]\nspacing_mm = 0.4\norder = 1\n[specimen.stl]\n{stl}\n{REST}")
}

/// The rows of a table of the results, without its header.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn quantity(path: &Path, name: &str) -> f64 {
    let row = rows(path).into_iter().find(|row| row[0] == name);
    row.unwrap_or_else(|| panic!("{name} is not in {}", path.display()))[1].parse().unwrap()
}

#[test]
fn grains_of_a_packing_come_back_from_their_files() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let run = |arguments: &[&str]| {
        let (code, out, err) = said(&breccia(dir.path(), arguments));
        assert_eq!(code, Some(0), "{arguments:?}: {err}");
        (out, err)
    };
    write("packing.toml", &format!("{PACKING}{REST}"));
    let command = ["surfaces", "packing.toml", "--out", "out"];
    let (out, err) =
        run(&[&command[..], &["--decimation", "30", "--smoothing-passes", "2"]].concat());
    assert_eq!(Path::new(out.trim()), Path::new("out").join("surfaces.csv"));
    assert!(err.contains("least distance 0.09"), "films of 0.1 mm, smoothed: {err}");
    let table = rows(&dir.path().join("out/surfaces.csv"));
    let mut volume = 0.0;
    for row in &table {
        let triangles = stl::read(dir.path().join("out").join(&row[1])).unwrap();
        assert_eq!(triangles.len().to_string(), row[3]);
        let enclosed = stl::enclosed_volume(&triangles);
        assert!((enclosed / row[4].parse::<f64>().unwrap() - 1.0).abs() < 1e-4);
        volume += enclosed;
    }
    let whole = std::f64::consts::PI * 2.5 * 2.5 * 4.4;
    assert!((volume / whole - 0.15).abs() < 0.005, "{}", volume / whole);
    assert!(err.contains(&format!("{} grains", table.len())), "{err}");

    write(
        "stl.toml",
        &surfaces_case("surfaces = \"out/surfaces\"\nmargin_mm = 0.1\nleast_distance_mm = 0.12"),
    );
    let (out, _) = run(&["check", "stl.toml"]);
    for part in [
        &format!("{} grains", table.len())[..],
        "least distance 0.12",
        "% of a cylinder of radius 2.",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    run(&["mesh", "stl.toml", "--out", "meshed"]);
    let mesh = dir.path().join("meshed/mesh.csv");
    assert_eq!(quantity(&mesh, "grains") as usize, table.len());
    let asked = quantity(&mesh, "surface_volume_mm3");
    assert!((quantity(&mesh, "volume_grain_mm3") / asked - 1.0).abs() < 0.01);
    assert!(asked < volume && asked > 0.93 * volume, "{asked} {volume}");
    assert!((quantity(&mesh, "least_distance_mm") - 0.12).abs() < 1e-6);
    run(&["simulate", "stl.toml", "--out", "simulated"]);
    let force = |folder: &str| -> f64 {
        let curve = rows(&dir.path().join(folder).join("curve.csv"));
        curve.last().unwrap()[1].parse().unwrap()
    };
    // for comparison, mesh the exact grains of the packing, in a cylinder that is slightly larger
    run(&["simulate", "packing.toml", "--out", "direct"]);
    let ratio = force("simulated") / force("direct");
    assert!((0.8..1.25).contains(&ratio), "{ratio}");

    // if the number of grain files changes, the mesh is made again; surplus files of an earlier run are removed
    let first = dir.path().join("out").join(&table[0][1]);
    let content = std::fs::read(&first).unwrap();
    std::fs::remove_file(&first).unwrap();
    for grains in [table.len() - 1, table.len()] {
        let (_, err) = run(&["mesh", "stl.toml", "--out", "meshed"]);
        assert!(err.contains("again, since"), "{err}");
        assert_eq!(quantity(&mesh, "grains") as usize, grains);
        std::fs::write(&first, &content).unwrap();
    }
    let fewer = PACKING.replace("0.15", "0.05");
    write("packing.toml", &format!("{fewer}{REST}"));
    run(&command);
    let files = std::fs::read_dir(dir.path().join("out/surfaces")).unwrap().count();
    assert_eq!(files, rows(&dir.path().join("out/surfaces.csv")).len());
    assert!(files < table.len());
}

/// A case with surfaces of a packing and measured curves of other packings runs every stage from the mesh to the
/// report.
#[test]
fn a_case_of_files_is_calibrated_up_to_its_report() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    let run = |arguments: &[&str]| {
        let (code, out, err) = said(&breccia(dir.path(), arguments));
        assert_eq!(code, Some(0), "{arguments:?}: {err}");
        (out, err)
    };
    write("packing.toml", &format!("{PACKING}{REST}"));
    run(&["surfaces", "packing.toml", "--out", "out", "--decimation", "60"]);
    run(&["init", "--own-data", "own"]);
    let case = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.2\norder = 1\n\
        [specimen.stl]\nsurfaces = \"out/surfaces\"\n\
        [material.matrix]\nyoung_mpa = 275.0\npoisson = 0.25\ntoughness_n_per_mm = 0.0025\n\
        viscosity_mpa_s = 0.3\n[material.grain]\nyoung_mpa = 22000.0\npoisson = 0.25\n\
        [phase_field]\nlength_mm = 0.06\n[test]\ndisplacement_mm = 0.22\nsteps = 22\n\
        stop_below_peak = 0.05\n[prior]\nmatrix.young_mpa = [180.0, 380.0]\n\
        matrix.viscosity_mpa_s = [0.1, 0.6]\n[design]\nruns = 8\n[surrogate]\nmax_order = 2\n\
        [experiments]\ntable = \"own/specimens.csv\"\n[calibration]\nchains = 2\nwarmup = 200\n\
        draws = 200\n[confirm]\ndraws = 1\n";
    write("stl.toml", case);
    let (out, _) = run(&["run", "stl.toml", "--out", "results"]);
    let results = dir.path().join("results");
    let grains = rows(&dir.path().join("out/surfaces.csv")).len();
    assert_eq!(quantity(&results.join("mesh.csv"), "grains") as usize, grains);
    assert!(out.contains("matrix.young_mpa"), "{out}");
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in
        ["Calibrated parameters", "grains of one specimen (specimen.stl)", "Damage at the MAP"]
    {
        assert!(page.contains(part), "{part:?} is not in the report");
    }
    assert!(std::fs::metadata(results.join("mesh.png")).unwrap().len() > 1000);

    // virtual specimens need a packing
    let measured = "[experiments]\ntable = \"own/specimens.csv\"\n";
    let made = "[experiments.virtual]\nspecimens = 3\nseed = 1\n\
        truth = { matrix.young_mpa = 280.0, matrix.viscosity_mpa_s = 0.3 }\n";
    write("virtual.toml", &case.replace(measured, made));
    let (code, _, err) = said(&breccia(dir.path(), &["check", "virtual.toml"]));
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("experiments.virtual") && err.contains("STL files"), "{err}");
}

/// Surfaces of grains that are found in a virtual scan have the volumes of `grains.csv`.
#[test]
fn grains_of_a_scan_have_surfaces() {
    let dir = tempfile::tempdir().unwrap();
    let packing = PACKING.replace("film_mm = 0.1", "film_mm = 0.3");
    let case = format!("{packing}[specimen.scan]\nvoxel_mm = 0.1\n[specimen.image]\n{REST}");
    std::fs::write(dir.path().join("my.toml"), case).unwrap();
    let command = ["surfaces", "my.toml", "--out", "out", "--least-distance-mm", "0.01"];
    let (code, _, err) = said(&breccia(dir.path(), &command));
    assert_eq!(code, Some(0), "{err}");
    let found = rows(&dir.path().join("out/grains.csv"));
    let surfaces = rows(&dir.path().join("out/surfaces.csv"));
    assert_eq!(surfaces.len(), found.len());
    let number = |text: &str| text.parse::<f64>().unwrap();
    for (grain, surface) in found.iter().zip(&surfaces) {
        assert_eq!(grain[0], surface[0]);
        let expected = number(&grain[1]) * number(&surface[8]).powi(3);
        assert!((number(&surface[4]) / expected - 1.0).abs() < 1e-6, "{grain:?} {surface:?}");
    }
}

#[test]
fn files_that_are_no_grains_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let mesh =
        fem::CylinderLattice { radius_mm: 1.0, height_mm: 2.0, spacing_mm: 0.5 }.build().unwrap();
    let good = stl::specimen(&mesh);
    let open = good[3..].to_vec();
    let mut turned = good.clone();
    turned[0].swap(1, 2);
    let copies = [("stl/a.stl", &good), ("stl/b.stl", &good)];
    for (files, keys, part) in [
        (&[][..], "", "there is no STL file"),
        (&[("stl/a.stl", &good), ("stl/open.stl", &open)], "", "open.stl: the surface"),
        (&[("stl/turned.stl", &turned)], "", "turned.stl: at 3 edges"),
        (&copies, "", "grains overlap"),
        (&copies, "least_distance_mm = 0.01", "remove one of them"),
        (&[("stl/a.stl", &good)], "unit_mm = 1000.0", "unit_mm = 1 would agree"),
    ] {
        let _ = std::fs::remove_dir_all(dir.path().join("stl"));
        std::fs::create_dir(dir.path().join("stl")).unwrap();
        for (name, triangles) in files {
            stl::write(dir.path().join(name), "grain", triangles).unwrap();
        }
        let case = surfaces_case(&format!("surfaces = \"stl\"\n{keys}"));
        std::fs::write(dir.path().join("my.toml"), case).unwrap();
        for command in [&["check", "my.toml"][..], &["mesh", "my.toml", "--out", "out"]] {
            let (code, _, err) = said(&breccia(dir.path(), command));
            assert_eq!(code, Some(1), "{command:?}: {err}");
            for part in [part, "my.toml: specimen.stl: "] {
                assert!(err.contains(part), "{command:?}: {part:?} is not in {err:?}");
            }
        }
    }
}
