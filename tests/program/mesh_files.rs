//! Mesh files that cannot be used: each file is refused before any load step, with the reason and a remedy.

use std::fmt::Write as _;

use fem::TetMesh;

use super::{SMALL, breccia, said};

/// Formats a mesh as MSH 2.2 without checks: volumes 1 and 2 (0: no group), surfaces 11 and 12.
fn msh(mesh: &TetMesh, volume_of: impl Fn(usize) -> u32) -> String {
    let mut out = String::from("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n");
    writeln!(out, "{}", mesh.nodes.len()).unwrap();
    for (k, [x, y, z]) in mesh.nodes.iter().enumerate() {
        writeln!(out, "{} {x:?} {y:?} {z:?}", k + 1).unwrap();
    }
    let faces: Vec<_> = [("bottom", 11), ("top", 12)]
        .iter()
        .flat_map(|(name, tag)| mesh.surfaces[*name].iter().map(move |face| (tag, face)))
        .collect();
    writeln!(out, "$EndNodes\n$Elements\n{}", faces.len() + mesh.tets.len()).unwrap();
    for (k, (tag, [a, b, c])) in faces.iter().enumerate() {
        writeln!(out, "{} 2 2 {tag} {tag} {} {} {}", k + 1, a + 1, b + 1, c + 1).unwrap();
    }
    for (k, [a, b, c, d]) in mesh.tets.iter().enumerate() {
        let (number, volume) = (faces.len() + k + 1, volume_of(k));
        let tags = if volume == 0 { "0".into() } else { format!("2 {volume} {volume}") };
        writeln!(out, "{number} 4 {tags} {} {} {} {}", a + 1, b + 1, c + 1, d + 1).unwrap();
    }
    out.push_str("$EndElements\n");
    out
}

/// Runs `simulate` on a mesh file. Returns exit code and error, and whether a curve was begun.
fn simulate(bytes: &[u8]) -> (Option<i32>, String, bool) {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("body.msh"), bytes).unwrap();
    let lattice = "radius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.5\n";
    let mesh =
        "mesh = \"body.msh\"\nregions = { matrix = 1 }\nsurfaces = { bottom = 11, top = 12 }\n";
    let case = SMALL.replace(lattice, mesh);
    let case = &case[..case.find("[prior]").unwrap()];
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
    (code, err, dir.path().join("out/curve.csv").exists())
}

fn assert_refused(bytes: &[u8], parts: &[&str]) {
    let (code, err, began) = simulate(bytes);
    assert!(code == Some(1) && !began, "{parts:?}: {err}");
    for part in ["body.msh"].iter().chain(parts) {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
}

#[test]
fn unusable_mesh_files_are_refused_before_any_step() {
    let cylinder = fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
    let sound = cylinder.build().unwrap();
    let whole = msh(&sound, |_| 1);
    let (code, err, began) = simulate(whole.as_bytes());
    assert!(code == Some(0) && began, "the sound mesh runs: {err}");

    assert_refused(b"a photograph", &["line 1", "`a photograph`", "save the mesh again"]);
    assert_refused(&whole.as_bytes()[..whole.len() / 2], &["line"]);
    assert_refused(&[0xff; 64], &["line 1", "save the mesh again"]);

    // one tetrahedron in no group, and one in a group that the case does not name
    let unlabelled = msh(&sound, |k| u32::from(k != 7));
    assert_refused(
        unlabelled.as_bytes(),
        &["1 tetrahedron belongs to no named region", "physical group"],
    );
    let foreign = msh(&sound, |k| 1 + u32::from(k == 9));
    assert_refused(
        foreign.as_bytes(),
        &["1 tetrahedron belongs", "physical volume 2", "list their physical group"],
    );

    let mut thick = sound.clone();
    thick.tets.push(sound.tets[0]);
    let thick = msh(&thick, |_| 1);
    assert_refused(
        thick.as_bytes(),
        &["face of nodes", "shared by 3 tetrahedra", "remove the duplicates"],
    );

    // a node that is moved through the faces around it inverts tetrahedra
    let on_surface = |node: u32| sound.surfaces.values().flatten().any(|face| face.contains(&node));
    let inner = (0..).find(|&node| !on_surface(node)).expect("a node inside");
    let mut tangled = sound.clone();
    tangled.nodes[inner as usize][0] += 2.0;
    assert_refused(msh(&tangled, |_| 1).as_bytes(), &["tetrahedra", "overlap", "mesh again"]);

    let mut flat = sound.clone();
    let [a, b, c, d] = sound.tets[0].map(|node| node as usize);
    flat.nodes[d] =
        std::array::from_fn(|k| (sound.nodes[a][k] + sound.nodes[b][k] + sound.nodes[c][k]) / 3.0);
    assert_refused(msh(&flat, |_| 1).as_bytes(), &["tetrahedr"]);

    let mut unclosed = sound;
    unclosed.nodes[3][2] = f64::NAN;
    assert_refused(msh(&unclosed, |_| 1).as_bytes(), &["node", "NaN"]);
}

#[test]
fn a_mesh_that_is_no_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("body.msh")).unwrap();
    let case = SMALL.replace(
        "radius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.5\n",
        "mesh = \"body.msh\"\nregions = { matrix = 1 }\n",
    );
    let case = &case[..case.find("[prior]").unwrap()];
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
    assert!(code == Some(1) && err.contains("body.msh"), "{err}");
    assert!(!dir.path().join("out/curve.csv").exists());
}
