//! MSH files: the four supported variants, the written variant, and rejected files.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use fem_mesh::gmsh::{self, GmshNames};
use fem_mesh::{CylinderLattice, MeshError, TetMesh};

use crate::gmsh_variants::{edges, sorted, v2, v2_with, v4};

/// Returns a lattice mesh with two regions, for round trips.
fn specimen() -> TetMesh {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build().unwrap();
    mesh.regions.push("grain".into());
    mesh.region_of[10..40].fill(1);
    mesh
}

fn names() -> GmshNames {
    GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12), ("side", 13)])
}

fn file(name: &str, bytes: impl AsRef<[u8]>) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// Asserts that two meshes are equal up to the order of regions and tetrahedra.
fn assert_same(read: &TetMesh, mesh: &TetMesh) {
    type Named<'a, const N: usize> = Vec<(&'a str, [u32; N])>;
    fn tets(mesh: &TetMesh) -> Named<'_, 4> {
        let region = |tet: usize| mesh.regions[mesh.region_of[tet] as usize].as_str();
        let mut all: Named<4> =
            mesh.tets.iter().enumerate().map(|(tet, &nodes)| (region(tet), nodes)).collect();
        all.sort_unstable();
        all
    }
    assert_eq!(read.nodes, mesh.nodes);
    assert_eq!(tets(read), tets(mesh));
    let sorted = |mesh: &TetMesh| -> BTreeMap<String, Vec<[u32; 3]>> {
        let sort = |faces: &Vec<[u32; 3]>| {
            let mut faces: Vec<[u32; 3]> = faces
                .iter()
                .map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap())
                .collect();
            faces.sort_unstable();
            faces
        };
        mesh.surfaces.iter().map(|(name, faces)| (name.clone(), sort(faces))).collect()
    };
    assert_eq!(sorted(read), sorted(mesh));
}

#[test]
fn a_written_mesh_is_read_back_unchanged() {
    let mesh = specimen();
    let (_dir, path) = file("a.msh", "");
    let group_numbers = gmsh::write(&path, &mesh).unwrap();
    assert_eq!(group_numbers, names());
    assert_same(&gmsh::read(&path, &group_numbers).unwrap(), &mesh);

    // select groups by their names in the file, and read all groups
    let by_name = GmshNames::new([("grain", "grain"), ("soft", "matrix")], [("base", "bottom")]);
    let read = gmsh::read(&path, &by_name).unwrap();
    assert_eq!(read.regions, ["grain", "soft"]);
    assert_eq!(read.surfaces["base"].len(), mesh.surfaces["bottom"].len());
    assert_same(&gmsh::read(&path, &GmshNames::default()).unwrap(), &mesh);
}

#[test]
fn grain_numbers_are_preserved_as_elementary_tags() {
    let mut mesh = specimen();
    let grain = |tet: usize| if mesh.region_of[tet] == 1 { 1 + (tet as u32) % 7 } else { 0 };
    mesh.grain_of = Some((0..mesh.tets.len()).map(grain).collect());
    // a grain that extends over two regions
    mesh.grain_of.as_mut().unwrap()[50] = 3;
    let (_dir, path) = file("a.msh", "");
    let names = gmsh::write(&path, &mesh).unwrap();
    let read = gmsh::read(&path, &names).unwrap();
    assert_same(&read, &mesh);
    assert!(
        read.grain_of == mesh.grain_of && read.tets == mesh.tets,
        "grain numbers or tetrahedra differ"
    );
    // regions with other names and in another order
    let turned = GmshNames::new([("a grain", "grain"), ("soft", "matrix")], [("base", "bottom")]);
    assert!(gmsh::read(&path, &turned).unwrap().grain_of == mesh.grain_of);

    // without grains the elementary tags are the region numbers
    mesh.grain_of = None;
    gmsh::write(&path, &mesh).unwrap();
    assert_eq!(gmsh::read(&path, &names).unwrap().grain_of, None);
    mesh.grain_of = Some(vec![u32::MAX; mesh.tets.len()]);
    let error = gmsh::write(&path, &mesh).unwrap_err();
    assert!(error.to_string().contains("grain number is too large"), "{error}");
}

/// Returns a lattice mesh with a curved wall, grain numbers and mixtures.
fn curved_specimen() -> TetMesh {
    let mut mesh = specimen();
    let on_wall = |node: u32| {
        let [x, y, _] = mesh.nodes[node as usize];
        (x.hypot(y) - 2.5).abs() < 1e-9
    };
    let wall = |(edge, [x, y, z]): ([u32; 2], [f64; 3])| {
        let scale = 2.5 / x.hypot(y);
        let is_chord = edge.into_iter().all(on_wall) && (scale - 1.0).abs() > 1e-9;
        is_chord.then_some((edge, [scale * x, scale * y, z]))
    };
    let on_surface: std::collections::BTreeSet<[u32; 2]> = (mesh.surfaces["side"].iter())
        .flat_map(|t| [[0, 1], [1, 2], [2, 0]].map(|ends| sorted(ends.map(|end| t[end]))))
        .collect();
    mesh.edge_points =
        edges(&mesh).into_iter().filter(|(e, _)| on_surface.contains(e)).filter_map(wall).collect();
    assert!(mesh.edge_points.len() > 10);
    mesh
}

#[test]
fn curved_edges_and_mixtures_are_read_back_bit_for_bit() {
    let mut mesh = curved_specimen();
    let (_dir, path) = file("a.msh", "");
    let names = gmsh::write(&path, &mesh).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.contains("\n2 13 9 ") && text.contains(" 11 "), "elements of second order");
    let read_back = |mesh: &TetMesh| {
        gmsh::write(&path, mesh).unwrap();
        gmsh::read(&path, &GmshNames::default()).unwrap()
    };
    assert_same(&gmsh::read(&path, &names).unwrap(), &mesh);
    // the reader sorts regions by name
    let in_order = |mesh: &mut TetMesh| {
        mesh.regions = vec!["matrix".into(), "grain".into()];
    };
    in_order(&mut mesh);
    assert_eq!(read_back(&mesh).edge_points, mesh.edge_points);
    assert_eq!(read_back(&mesh), mesh);

    mesh.grain_of = Some(mesh.region_of.iter().map(|&region| 5 * u32::from(region)).collect());
    let fraction =
        |tet: usize| if mesh.region_of[tet] == 0 { 0.1 * (tet % 10) as f32 } else { 0.0 };
    let mixture = |tet| fem_mesh::Mixture {
        fraction: fraction(tet),
        normal: if fraction(tet) > 0.3 { [0.6, 0.0, -0.8] } else { [0.0; 3] },
        region: 1,
    };
    mesh.mixture = Some((0..mesh.tets.len()).map(mixture).collect());
    assert_eq!(read_back(&mesh), mesh);

    // no tetrahedron belongs entirely to a grain
    mesh.region_of.fill(0);
    mesh.grain_of = Some(vec![0; mesh.tets.len()]);
    assert_eq!(read_back(&mesh), mesh);
    let renamed = GmshNames::new([("a grain", "grain"), ("soft", "matrix")], [("base", "bottom")]);
    let read = gmsh::read(&path, &renamed).unwrap();
    assert_eq!((read.regions.len(), read.region_of[0]), (2, 1));
    // the second phase is identified by its physical group, even if the order of the names differs
    let in_order = |mixture: &fem_mesh::Mixture| fem_mesh::Mixture { region: 0, ..*mixture };
    let expected = mesh.mixture.as_ref().map(|all| all.iter().map(in_order).collect::<Vec<_>>());
    assert_eq!(read.mixture, expected);

    // mixtures with several phases
    mesh.regions.push("inclusion".into());
    let mixtures = mesh.mixture.as_mut().unwrap();
    mixtures.iter_mut().step_by(3).for_each(|mixture| mixture.region = 2);
    assert_eq!(read_back(&mesh), mesh);
}

#[test]
fn second_order_files_of_gmsh_keep_their_curved_edges() {
    let mesh = curved_specimen();
    for binary in [false, true] {
        let (_dir, path) = file("a.msh", v4(&mesh, binary, false, true));
        let read = gmsh::read(&path, &names()).unwrap();
        assert_same(&read, &mesh);
        assert_eq!(read.edge_points, mesh.edge_points);
    }
    // a different mid-edge node in one tetrahedron
    let text = String::from_utf8(v4(&mesh, false, false, true)).unwrap();
    let last = text.trim_end().trim_end_matches("$EndElements").trim_end();
    let (rest, _) = last.rsplit_once(' ').unwrap();
    let torn = format!("{rest} 900000\n$EndElements\n");
    assert_contains(&fault(torn, &names()), &["different mid-edge nodes", "conforming"]);
}

#[test]
fn a_byte_order_mark_is_skipped() {
    let mesh = specimen();
    let (_dir, path) = file("a.msh", [b"\xef\xbb\xbf", &v2(&mesh, false)[..]].concat());
    assert_same(&gmsh::read(&path, &names()).unwrap(), &mesh);
}

#[test]
fn gmsh_itself_meshes_a_model() {
    let dir = tempfile::tempdir().unwrap();
    let model = gmsh::SphereModel {
        radius_mm: 2.5,
        height_mm: 4.4,
        spheres: vec![([0.5, 0.25, 1.5], 0.7), ([-0.9, -0.3, 2.9], 0.8)],
        spacing_mm: 0.7,
        curved: true,
    };
    let nowhere = model.mesh(Path::new("no-such-mesher"), dir.path()).unwrap_err();
    assert_contains(&nowhere.to_string(), &["no-such-mesher", "install Gmsh"]);
    let program = std::env::var_os("GMSH").unwrap_or_else(|| "gmsh".into());
    if std::process::Command::new(&program).arg("--version").output().is_err() {
        eprintln!("SKIPPED: Gmsh is not installed; put it on the search path or set GMSH");
        return;
    }
    let mesh = model.mesh(Path::new(&program), dir.path()).unwrap();
    let pi = std::f64::consts::PI;
    let ball = |radius: f64| 4.0 / 3.0 * pi * radius.powi(3);
    let close = |value: f64, expected: f64, tolerance: f64| {
        assert!((value / expected - 1.0).abs() < tolerance, "{value} against {expected}");
    };
    close(mesh.volume(), pi * 2.5 * 2.5 * 4.4, 1e-3);
    let volumes = mesh.volumes();
    for (number, radius) in [(1, 0.7), (2, 0.8)] {
        let of = volumes.iter().zip(mesh.grain_of.as_ref().unwrap());
        close(of.filter(|(_, g)| **g == number).map(|(v, _)| v).sum(), ball(radius), 5e-3);
    }
    // Gmsh also reads the files written by this crate
    let (written, again) = (dir.path().join("written.msh"), dir.path().join("again.msh"));
    let names = gmsh::write(&written, &mesh).unwrap();
    assert_eq!(gmsh::read(&written, &names).unwrap().edge_points, mesh.edge_points);
    let status = std::process::Command::new(&program)
        .arg(&written)
        .args(["-save", "-v", "2", "-format", "msh41", "-o"])
        .arg(&again)
        .status();
    assert!(status.unwrap().success());
    let reopened = gmsh::read(&again, &GmshNames::default()).unwrap();
    close(reopened.volume(), mesh.volume(), 1e-12);
    close(reopened.region_volume("grain").unwrap(), mesh.region_volume("grain").unwrap(), 1e-12);
}

#[test]
fn all_variants_give_the_same_mesh() {
    let mesh = specimen();
    for (name, bytes) in [
        ("2.2 ASCII", v2(&mesh, false)),
        ("2.2 binary", v2(&mesh, true)),
        ("2.2 ASCII, parametric", v2_with(&mesh, false, true)),
        ("2.2 binary, parametric", v2_with(&mesh, true, true)),
        ("4.1 ASCII", v4(&mesh, false, false, false)),
        ("4.1 binary", v4(&mesh, true, false, false)),
        ("4.1 binary, big endian", v4(&mesh, true, true, false)),
        ("4.1 ASCII, second order", v4(&mesh, false, false, true)),
        ("4.1 binary, second order", v4(&mesh, true, false, true)),
    ] {
        let (_dir, path) = file("a.msh", bytes);
        let read = gmsh::read(&path, &names()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_same(&read, &mesh);
        assert_eq!(
            read.grain_of, None,
            "elementary tags of other programs were read as grain numbers"
        );
    }
}

fn fault(bytes: impl AsRef<[u8]>, names: &GmshNames) -> String {
    let (_dir, path) = file("bad.msh", bytes);
    let message = gmsh::read(&path, names).unwrap_err().to_string();
    assert!(message.contains("bad.msh"), "the file is not named: {message}");
    message
}

fn assert_contains(message: &str, fragments: &[&str]) {
    for fragment in fragments {
        assert!(message.contains(fragment), "`{fragment}` is missing in: {message}");
    }
}

#[test]
fn errors_state_position_value_and_remedy() {
    let mesh = specimen();
    let text = String::from_utf8(v2(&mesh, false)).unwrap();
    let names = names();

    assert_contains(&fault("solid stl\n", &names), &["line 1", "solid stl"]);
    assert_contains(
        &fault("$MeshFormat\n4.0 0 8\n$EndMeshFormat\n", &names),
        &["line 2", "4.0", "2.2 or 4.1"],
    );
    let spoilt = text.replacen("4.4\n", "4,4\n", 1);
    let line = 1 + text.lines().position(|line| line.ends_with(" 4.4")).unwrap();
    assert_contains(
        &fault(&spoilt, &names),
        &[&format!("line {line} (section $Nodes)"), "4,4", "coordinate"],
    );
    assert_contains(&fault(&text[..text.len() / 2], &names), &["line"]);
    assert_contains(
        &fault(text.replacen("\n$Nodes\n", "\n$Nodes\n1", 1), &names),
        &["$Nodes", "$EndNodes"],
    );
    let binary = v4(&mesh, true, false, false);
    assert_contains(
        &fault(&binary[..binary.len() - 200], &names),
        &["section $Elements, byte", "ends too early"],
    );

    // the error for a missing group lists the existing groups
    let mut wrong = names.clone();
    wrong.regions.insert("grain".into(), 5.into());
    assert_contains(&fault(&text, &wrong), &["region `grain`", "group 5", "has 1, 2"]);
    let mut wrong = names.clone();
    wrong.surfaces.insert("top".into(), "lid".into());
    assert_contains(&fault(&text, &wrong), &["surface `top`", "\"lid\"", "11, 12, 13"]);
    let only_matrix = GmshNames::new([("matrix", 1)], [("bottom", 11)]);
    let message = fault(&text, &only_matrix);
    assert_contains(&message, &["30 tetrahedra belong to no named region"]);
    assert_contains(&message, &["30 of volume 52 (physical volume 2)"]);
    let ungrouped = text.replace(" 4 2 2 52 ", " 4 2 0 52 ");
    assert_contains(&fault(&ungrouped, &only_matrix), &["30 of volume 52 (no physical volume)"]);

    // in MSH 2.2 with Mesh.SaveAll, Gmsh writes elements without groups
    let lost = text.replace(" 4 2 2 52 ", " 4 2 0 52 ").replace(" 4 2 1 51 ", " 4 2 0 51 ");
    let named = "$PhysicalNames\n1\n3 1 \"matrix\"\n$EndPhysicalNames\n$Nodes\n";
    let lost =
        lost.replacen("$Nodes\n", "$Nodes \n", 1).replacen("\n$Nodes\n", &format!("\n{named}"), 1);
    assert_contains(&fault(&lost, &only_matrix), &["Mesh.SaveAll", "4.1"]);

    // a hexahedron, and a reference to a node that does not exist
    let mut hexahedron = text.clone();
    hexahedron = hexahedron.replacen("1 2 2 11 41 ", "1 5 2 11 41 7 7 7 7 7 ", 1);
    assert_contains(&fault(&hexahedron, &names), &["type 5", "tetrahedra"]);
    let missing = text.replacen(" 11 41 ", " 11 41 999999 ", 1);
    assert_contains(&fault(&missing, &names), &["999999"]);

    let absent = gmsh::read("nowhere/cylinder.msh", &names).unwrap_err();
    assert!(matches!(absent, MeshError::Io { action: "read", .. }));
    assert_contains(&absent.to_string(), &["cannot read", "nowhere"]);
}

#[test]
fn names_come_from_a_case_file() {
    let names: GmshNames =
        serde_json::from_str(r#"{"regions": {"matrix": 1, "grain": "stones"}}"#).unwrap();
    assert_eq!(names.regions["matrix"], 1.into());
    assert_eq!(names.regions["grain"], "stones".into());
    assert!(serde_json::from_str::<GmshNames>(r#"{"region": {}}"#).is_err());
}

/// Returns the folder of the project's shared data, which may not exist.
fn shared() -> PathBuf {
    match std::env::var_os("BRECCIA_SHARED") {
        Some(path) => path.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
    }
}

#[test]
fn reference_cylinder() {
    let path = shared().join("data/fem/cyl_a.msh");
    if !path.exists() {
        eprintln!("SKIPPED: {} is absent; set BRECCIA_SHARED to check it", path.display());
        return;
    }
    let mesh = gmsh::read(&path, &names()).unwrap();
    assert_eq!((mesh.nodes.len(), mesh.tets.len()), (3950, 19443));
    let close = |value: f64, expected: f64| {
        assert!((value / expected - 1.0).abs() < 1e-9, "{value} against {expected}");
    };
    close(mesh.volume(), 86.24230777795543);
    close(mesh.region_volume("grain").unwrap(), 8.523221291952499);
    let triangles = ["bottom", "top", "side"].map(|name| mesh.surfaces[name].len());
    assert_eq!(triangles, [541, 541, 1856]);

    let mut message = String::new();
    write!(message, "{}", fem_mesh::Quality::of(&mesh)).unwrap();
    assert!(message.contains("19443 tetrahedra"));
}
