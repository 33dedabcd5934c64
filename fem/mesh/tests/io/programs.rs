//! Exchange of mesh files with Gmsh and meshio, if these are installed for Python.

use std::path::Path;
use std::process::Command;

use fem_mesh::gmsh::{self, GmshNames, ImportNote};
use fem_mesh::{CylinderLattice, Mixture, TetMesh};

/// Runs `tests/python/mesh_files.py`; returns `None` if the Python modules are missing.
fn python(arguments: &[&Path]) -> Option<String> {
    let python = std::env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let mut modules = Command::new(&python);
    if !modules.args(["-c", "import gmsh, meshio"]).output().is_ok_and(|o| o.status.success()) {
        eprintln!(
            "SKIPPED: {python} has no gmsh or no meshio; set BRECCIA_PYTHON to one that has both"
        );
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/python/mesh_files.py");
    let output = Command::new(&python).arg(script).args(arguments).output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{}", said.concat());
    Some(said[0].clone())
}

fn specimen() -> TetMesh {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.2 }.build().unwrap();
    mesh.regions.push("grain".into());
    for tet in (0..mesh.tets.len()).step_by(3) {
        mesh.region_of[tet] = 1;
    }
    mesh.grain_of = Some(
        mesh.region_of.iter().zip(0..).map(|(&r, tet)| u32::from(r) * (1 + tet % 5)).collect(),
    );
    let mixture = |tet: usize| Mixture {
        fraction: if mesh.region_of[tet] == 0 { 0.125 * (tet % 8) as f32 } else { 0.0 },
        normal: [0.0, 0.6, 0.8],
        ..Mixture::default()
    };
    mesh.mixture = Some((0..mesh.tets.len()).map(mixture).collect());
    mesh
}

#[test]
fn gmsh_and_meshio_read_what_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let mut mesh = specimen();
    let edge = {
        let [a, b, ..] = mesh.tets[0];
        [a.min(b), a.max(b)]
    };
    for (name, is_curved) in [("straight.msh", false), ("curved.msh", true)] {
        if is_curved {
            let [p, q] = edge.map(|node| mesh.nodes[node as usize]);
            mesh.edge_points = vec![(edge, std::array::from_fn(|k| 0.5 * (p[k] + q[k]) + 0.02))];
        }
        let path = dir.path().join(name);
        gmsh::write(&path, &mesh).unwrap();
        let Some(said) = python(&["check".as_ref(), &path]) else { return };
        let value = |key: &str| -> f64 {
            let line = said.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
            line.unwrap_or_else(|| panic!("{key} is missing in: {said}")).trim().parse().unwrap()
        };
        let straight = TetMesh { edge_points: Vec::new(), ..mesh.clone() };
        let grains: f64 = straight.region_volume("grain").unwrap();
        let mixture: f64 = (straight.volumes().iter().zip(mesh.mixture.as_ref().unwrap()))
            .map(|(volume, mixture)| volume * f64::from(mixture.fraction))
            .sum();
        for (key, expected) in [
            ("gmsh tetrahedra", mesh.tets.len() as f64),
            ("gmsh volume", mesh.volume()),
            ("gmsh views", 2.0),
            ("meshio tetrahedra", mesh.tets.len() as f64),
            ("meshio grain_volume", grains),
            ("meshio mixed_volume", mixture),
        ] {
            let found = value(key);
            assert!((found / expected - 1.0).abs() < 1e-9, "{key}: {found}, not {expected}");
        }
        assert!(value("meshio blocks") <= 3.0 + 2.0 * 6.0, "{said}");
    }
}

#[test]
fn second_order_meshes_of_gmsh_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let Some(said) = python(&["make".as_ref(), dir.path()]) else { return };
    let names = GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12)]);
    let mut straightened = 0;
    let mut read = 0;
    for line in said.lines() {
        // name, number of tetrahedra, number of folded tetrahedra, volume of the spheres (mm³)
        let [name, tets, folded, spheres] = line.split_whitespace().collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let imported = gmsh::import(dir.path().join(name), &names).unwrap();
        let mesh = &imported.mesh;
        assert_eq!(mesh.tets.len(), tets.parse::<usize>().unwrap());
        let folded: usize = folded.parse().unwrap();
        let count = imported.notes.iter().map(|note| match note {
            ImportNote::Straightened { tets, .. } => tets.len(),
            other => panic!("{name}: {other}"),
        });
        let count: usize = count.sum();
        assert!(
            count >= folded && (folded > 0 || count == 0),
            "{name}: {count}, Gmsh finds {folded}"
        );
        let spheres: f64 = spheres.parse().unwrap();
        let volume = mesh.region_volume("grain").unwrap();
        // coarse spheres have few elements, and straightened faces reduce their volume
        let tolerance = if folded > 0 { 0.3 } else { 0.08 };
        assert!((volume / spheres - 1.0).abs() < tolerance, "{name}: {volume}, not {spheres} mm³");
        straightened += usize::from(count > 0);
        read += 1;
    }
    assert!(read == 4 && straightened > 0, "{read} files, {straightened} with folded elements");
}
