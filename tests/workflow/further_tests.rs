//! The expected benefit of further tests: the stage `next-test`.

use std::collections::BTreeMap;
use std::path::Path;

use super::{TINY, breccia, copy_of_tiny, finished, number, start, table};

const GC: &str = "matrix.toughness_n_per_mm";

/// The tiny case with two candidates: a further quantity of the present curves, and a slow test.
fn case() -> String {
    TINY.to_owned()
        + r#"
[further_tests]
specimens = [8, 2]
width90 = { matrix.toughness_n_per_mm = 0.003, matrix.young_mpa = 1e-4 }
[[further_tests.candidate]]
name = "work to the peak"
quantities = ["energy-to-peak"]
[[further_tests.candidate]]
name = "a hundred times slower"
runs = 8
quantities = ["peak-force", "displacement-at-peak", "energy-to-peak"]
scatter_percent = { energy-to-peak = 15.0 }
set.test.duration_s = 100.0
set.test.displacement_mm = 0.11
[[further_tests.candidate]]
name = "too short"
runs = 4
set.test.displacement_mm = 0.01
"#
}

fn row<'a>(
    rows: &'a [BTreeMap<String, String>],
    cells: &[(&str, &str)],
) -> &'a BTreeMap<String, String> {
    let is_it = |row: &&BTreeMap<String, String>| {
        cells.iter().all(|(column, value)| row[*column] == *value)
    };
    rows.iter().find(is_it).unwrap_or_else(|| panic!("no line {cells:?}"))
}

fn contraction(rows: &[BTreeMap<String, String>], name: &str, n: &str, parameter: &str) -> f64 {
    let cells = [("candidate", name), ("specimens", n), ("parameter", parameter)];
    number(row(rows, &cells), "contraction")
}

#[test]
fn a_slow_test_tells_what_fast_ones_leave_open() {
    let dir = copy_of_tiny();
    std::fs::write(dir.path().join("tiny.toml"), case()).unwrap();
    let run = || breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);

    // the stage was interrupted while it computed runs; it continues with the remaining runs
    let results = dir.path().join("results");
    let runs = results.join("ensemble");
    let mut child = start(dir.path(), &["run", "tiny.toml", "--out", "results", "--threads", "1"]);
    while finished(&runs).len() < 16 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = finished(&runs);
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    // 12 runs of the design, one run with the other quadrature, 8 slow runs, 4 runs that end before their peak
    let now = finished(&runs);
    assert_eq!(now.len(), 25);
    assert!(kept.iter().all(|(path, time)| now.get(path) == Some(time)), "a run was run again");

    // a candidate whose runs have no peak is omitted with a warning, and the run continues to its report
    let failed = std::fs::read_to_string(results.join("next-test-failed.csv")).unwrap();
    assert_eq!(failed.lines().count(), 2, "{failed}");
    for part in ["too short,", "4 of 4 runs have no quantities", "no peak", "test.displacement_mm"]
    {
        assert!(failed.contains(part), "{part}: {failed}");
    }
    for part in ["\"too short\" is omitted", "4 of 4 runs have no quantities", "no peak"] {
        assert!(err.contains(part), "{part}: {err}");
    }
    let rows = table(&results.join("next-test.csv"));
    assert_eq!(rows.len(), 3 * 3 * 3);
    // with no further specimens, the contraction equals the contraction of the calibration
    let summary = table(&results.join("summary.csv"));
    let widths = [50.0, 0.005 - 0.00001, 0.5];
    for (summary, width) in summary.iter().zip(widths) {
        let exact = 1.0 - 12.0 * number(summary, "sd").powi(2) / (width * width);
        let found = contraction(&rows, "more specimens", "0", &summary["parameter"]);
        assert!((found - exact).abs() < 5e-3, "{found} {summary:?}");
    }
    for name in ["more specimens", "work to the peak", "a hundred times slower"] {
        for parameter in ["matrix.young_mpa", GC, "matrix.viscosity_mpa_s"] {
            let at = ["0", "2", "8"].map(|n| contraction(&rows, name, n, parameter));
            assert!(at[0] <= at[1] && at[1] <= at[2] && at[2] < 1.0, "{name} {parameter} {at:?}");
        }
    }
    // Gc has an effect only in slow tests
    let of_gc = |name: &str| contraction(&rows, name, "8", GC);
    assert!(of_gc("more specimens") < 0.2, "{}", of_gc("more specimens"));
    let slow = of_gc("a hundred times slower");
    assert!(slow > 0.5 && slow > of_gc("more specimens") + 0.3, "{slow}");

    let needed = table(&results.join("next-test-specimens.csv"));
    assert_eq!(needed.len(), 3 * (3 + 2));
    let of = |name: &str, parameter: &str, goal: &str| {
        row(&needed, &[("candidate", name), ("parameter", parameter), ("goal", goal)])
    };
    let slow = of("a hundred times slower", GC, "contraction");
    assert!((1.0..=8.0).contains(&number(slow, "specimens")), "{slow:?}");
    // the error that specimens share does not decrease with their number
    let never = of("more specimens", "matrix.young_mpa", "width90");
    assert!(never["specimens"].is_empty() && number(never, "limit") > 1e-4, "{never:?}");

    // the runs of a candidate are a dataset, and the report shows the results
    let data = surrogate::Dataset::read_csv(results.join("next-test/candidate-2.csv")).unwrap();
    // if Gc is close to 0, a slow test may break before its quantities can be measured
    assert!((6..=8).contains(&data.len()) && data.outputs().len() == 3);
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("Expected benefit of further tests"));
    assert!(page.contains("a hundred times slower") && page.contains("never: "));
    assert!(page.contains("<li>too short: 4 of 4 runs have no quantities"));

    // the same command makes no product again; another number of specimens needs no run
    let before = std::fs::read(results.join("next-test.csv")).unwrap();
    let (code, _, err) = run();
    assert!(code == Some(0) && err.contains("next-test finished before, unchanged"), "{err}");
    assert!(before == std::fs::read(results.join("next-test.csv")).unwrap());
    let other = case().replace("specimens = [8, 2]", "specimens = [8, 2, 4]");
    std::fs::write(dir.path().join("tiny.toml"), other).unwrap();
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    assert!(finished(&runs) == now, "a run was made");
    assert_eq!(table(&results.join("next-test.csv")).len(), 3 * 3 * 4);
}

/// A candidate whose specimen is a mesh file: a cylinder without grains, with a ring cut out of its wall.
#[test]
fn a_notched_specimen_is_a_mesh_file_of_its_own() {
    let dir = copy_of_tiny();
    notched(&dir.path().join("notched.msh"));
    let text = TINY.to_owned()
        + r#"
[[further_tests.candidate]]
name = "notched"
runs = 5
set.specimen = { mesh = "notched.msh", regions = { matrix = "matrix" }, surfaces = { bottom = "bottom", top = "top" } }
"#;
    std::fs::write(dir.path().join("tiny.toml"), text).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");
    assert!(results.join("candidates/1.msh").is_file());
    let rows = table(&results.join("next-test.csv"));
    assert!(contraction(&rows, "notched", "8", "matrix.young_mpa") > 0.0);
    // the notched specimen is weaker than the whole specimen
    let mean = |path: &str| {
        let rows = table(&results.join(path));
        rows.iter().map(|row| number(row, "peak_force_N")).sum::<f64>() / rows.len() as f64
    };
    assert!(mean("next-test/candidate-1.csv") < 0.8 * mean("runs.csv"));
}

/// A cylinder without the tetrahedra near the wall at mid-height.
fn notched(path: &Path) {
    let lattice = fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.1 };
    let mut mesh = lattice.build().unwrap();
    let is_kept = |tet: &[u32; 4]| {
        let middle = |k: usize| tet.iter().map(|&n| mesh.nodes[n as usize][k]).sum::<f64>() / 4.0;
        (middle(2) - 2.2).abs() > 0.55 || middle(0).hypot(middle(1)) < 1.6
    };
    let (tets, region_of): (Vec<[u32; 4]>, Vec<u16>) =
        mesh.tets.iter().zip(&mesh.region_of).filter(|(tet, _)| is_kept(tet)).unzip();
    // new indices of the remaining nodes
    let mut number = vec![u32::MAX; mesh.nodes.len()];
    let mut nodes = Vec::new();
    for &node in tets.iter().flatten() {
        if number[node as usize] == u32::MAX {
            number[node as usize] = nodes.len() as u32;
            nodes.push(mesh.nodes[node as usize]);
        }
    }
    mesh.tets = tets.iter().map(|tet| tet.map(|node| number[node as usize])).collect();
    mesh.surfaces.retain(|name, _| name != "side");
    for triangle in mesh.surfaces.values_mut().flatten() {
        *triangle = triangle.map(|node| number[node as usize]);
    }
    (mesh.nodes, mesh.region_of) = (nodes, region_of);
    fem::gmsh::write(path, &mesh).unwrap();
}
