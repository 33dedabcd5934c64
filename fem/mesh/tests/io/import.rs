//! Repairs and notes when a mesh of another program is imported.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use fem_mesh::gmsh::{self, GmshNames, ImportNote, Imported};
use fem_mesh::{CylinderLattice, MeshError, Quality, TetMesh};

type Point = [f64; 3];
/// Edges of a tetrahedron in Gmsh's order.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]];

fn file(text: &str) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.msh");
    std::fs::write(&path, text).unwrap();
    (dir, path)
}

/// Returns a MSH 4.1 file of second-order tetrahedra in one volume with one group; `bent` contains the mid-edge nodes
/// of curved edges.
fn second_order(nodes: &[Point], tets: &[[u32; 4]], bent: &BTreeMap<[u32; 2], Point>) -> String {
    let mut positions = nodes.to_vec();
    let mut middles = BTreeMap::new();
    let mut elements = String::new();
    for (number, tet) in tets.iter().enumerate() {
        write!(elements, "{}", number + 1).unwrap();
        tet.iter().for_each(|node| write!(elements, " {}", node + 1).unwrap());
        for ends in EDGES.map(|ends| ends.map(|end| tet[end])) {
            let edge = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            let [p, q] = edge.map(|node| nodes[node as usize]);
            let straight = std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
            let tag = *middles.entry(edge).or_insert_with(|| {
                positions.push(*bent.get(&edge).unwrap_or(&straight));
                positions.len()
            });
            write!(elements, " {tag}").unwrap();
        }
        elements.push('\n');
    }
    let count = positions.len();
    let mut out = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 1 0\n$EndEntities\n\
         $Nodes\n1 {count} 1 {count}\n3 1 0 {count}\n"
    );
    (1..=count).for_each(|tag| writeln!(out, "{tag}").unwrap());
    positions.iter().for_each(|[x, y, z]| writeln!(out, "{x:?} {y:?} {z:?}").unwrap());
    let count = tets.len();
    write!(
        out,
        "$EndNodes\n$Elements\n1 {count} 1 {count}\n3 1 11 {count}\n{elements}$EndElements\n"
    )
    .unwrap();
    out
}

/// Returns two tetrahedra that share the face 123, with node 4 at a given depth below the face.
fn pair(depth: f64) -> (Vec<Point>, Vec<[u32; 4]>) {
    let nodes = vec![
        [0.3, 0.3, 1.0],
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.3, 0.3, -depth],
    ];
    (nodes, vec![[1, 2, 3, 0], [1, 3, 2, 4]])
}

fn read(text: &str) -> Result<Imported, MeshError> {
    let (_dir, path) = file(text);
    gmsh::import(&path, &GmshNames::new([("matrix", 1)], Vec::<(&str, i32)>::new()))
}

#[test]
fn a_curved_element_with_inverted_corners_is_read_unchanged() {
    // node 4 is above the plane of face 123; the edges of the face bulge upwards above node 4, and the edges that end
    // at node 4 bulge less
    let (nodes, tets) = pair(-0.02);
    let mut bent: BTreeMap<[u32; 2], Point> =
        [([1, 2], [0.5, 0.0, 0.3]), ([1, 3], [0.0, 0.5, 0.3]), ([2, 3], [0.5, 0.5, 0.3])].into();
    bent.extend([1, 2, 3].map(|corner| {
        let [x, y, z] = std::array::from_fn(|k| 0.5 * (nodes[corner][k] + nodes[4][k]));
        ([corner as u32, 4], [x, y, z + 0.15])
    }));
    let text = second_order(&nodes, &tets, &bent);
    let Imported { mesh, notes } = read(&text).unwrap();
    assert_eq!((mesh.edge_points.len(), &notes), (6, &Vec::new()));
    assert_eq!(mesh.tets, tets, "a tetrahedron was reversed");
    let straight = mesh.validate_straight().unwrap_err();
    assert!(matches!(straight, MeshError::Inverted { tet: 1, .. }), "{straight}");
    assert!(Quality::of(&mesh).min_scaled_jacobian > 0.0);
    // the same mesh with one tetrahedron in reversed orientation
    let turned = second_order(&nodes, &[tets[0], [3, 1, 2, 4]], &bent);
    let volumes = read(&turned).unwrap().mesh.volumes();
    assert!(volumes.iter().zip(mesh.volumes()).all(|(v, w)| (v - w).abs() < 1e-15 && *v > 0.0));
    // a file that this crate has written gives the same edge points
    let (_dir, path) = file("");
    gmsh::write(&path, &mesh).unwrap();
    assert_eq!(gmsh::read(&path, &GmshNames::default()).unwrap().edge_points, mesh.edge_points);
}

#[test]
fn folded_elements_are_straightened_and_reported() {
    let (nodes, tets) = pair(1.0);
    // an edge of tetrahedron 0 that passes through its interior, and a slightly bent edge of tetrahedron 1
    let folding = ([0, 1], [0.6, 0.6, 0.5]);
    let bent = BTreeMap::from([folding, ([3, 4], [0.14, 0.66, -0.5])]);
    let Imported { mesh, notes } = read(&second_order(&nodes, &tets, &bent)).unwrap();
    assert_eq!(notes, [ImportNote::Straightened { tets: vec![0], all: 2 }]);
    assert_eq!(mesh.edge_points, [([3, 4], bent[&[3, 4]])], "the neighbour keeps its curved edge");
    let message = notes[0].to_string();
    assert!(
        message.contains("1 of 2 tetrahedra") && message.contains("straightened: 0;"),
        "{message}"
    );

    // the message lists five of many straightened tetrahedra
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build().unwrap();
    let all: BTreeMap<[u32; 2], Point> = (mesh.tets.iter())
        .map(|&[a, b, c, d]| {
            let far = |k: usize| mesh.nodes[c as usize][k] + mesh.nodes[d as usize][k];
            ([a.min(b), a.max(b)], std::array::from_fn(|k| 0.5 * far(k)))
        })
        .collect();
    let read_back = read(&second_order(&mesh.nodes, &mesh.tets, &all)).unwrap();
    let [ImportNote::Straightened { tets, .. }] = &read_back.notes[..] else { panic!("a note") };
    let others = format!(" and {} others;", tets.len() - 5);
    assert!(tets.len() > 100 && read_back.notes[0].to_string().contains(&others));
    assert!((read_back.mesh.volume() / mesh.volume() - 1.0).abs() < 1e-12);

    // without the repair, the validation reports all folded tetrahedra
    mesh.edge_points = all.into_iter().collect();
    let MeshError::Several { first, count } = mesh.validate().unwrap_err() else {
        panic!("several")
    };
    assert!(first.len() == 5 && count > 100);
    assert!(first.iter().all(|fault| matches!(fault, MeshError::Folded { .. })));
    let message = mesh.validate().unwrap_err().to_string();
    assert!(message.contains(&format!("{count} errors:")) && message.ends_with("; …"));
}

/// Returns a lattice mesh with four groups: matrix 1, and parts 10, 11 and 12 along the axis.
fn grouped() -> TetMesh {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.8 }.build().unwrap();
    mesh.regions = ["matrix", "a", "b", "c"].map(String::from).to_vec();
    for tet in 0..mesh.tets.len() {
        let corners = mesh.corners(tet);
        let middle: [f64; 3] = std::array::from_fn(|k| corners.iter().map(|p| 0.25 * p[k]).sum());
        let [x, y, z] = middle;
        let is_inside = x.hypot(y) < 1.2 && (0.9..3.5).contains(&z);
        mesh.region_of[tet] = if !is_inside { 0 } else { 1 + (z > 1.8) as u16 + (z > 2.7) as u16 };
    }
    mesh
}

#[test]
fn several_groups_form_one_region_or_surface() {
    let mesh = grouped();
    let (_dir, path) = file("");
    gmsh::write(&path, &mesh).unwrap();
    let mut names = GmshNames::new([("matrix", 1)], Vec::<(&str, i32)>::new());
    names.surfaces.insert("ends".into(), [11, 12].into());
    names.regions.insert("grain".into(), ["a", "b", "c"].into());
    let read = gmsh::read(&path, &names).unwrap();
    assert_eq!(read.regions, ["grain", "matrix"]);
    let total: f64 = ["a", "b", "c"].iter().map(|r| mesh.region_volume(r).unwrap()).sum();
    assert!((read.region_volume("grain").unwrap() / total - 1.0).abs() < 1e-12);
    let ends = mesh.surfaces["bottom"].len() + mesh.surfaces["top"].len();
    assert_eq!(read.surfaces["ends"].len(), ends);

    let json = r#"{"regions": {"grain": [2, "b", 4], "matrix": 1}, "surfaces": {"bottom": 11}}"#;
    let from_case: GmshNames = serde_json::from_str(json).unwrap();
    assert_eq!(gmsh::read(&path, &from_case).unwrap().region_of, read.region_of);
    let back = serde_json::to_string(&from_case).unwrap();
    assert_eq!(back, json.replace(": ", ":").replace(", ", ","));
    let wrong: GmshNames = serde_json::from_str(&json.replace('4', "7")).unwrap();
    let message = gmsh::read(&path, &wrong).unwrap_err().to_string();
    assert!(message.contains("region `grain` should be physical group 7"), "{message}");
}

#[test]
fn a_volume_without_a_physical_group_is_reported() {
    let mesh = grouped();
    let (_dir, path) = file("");
    gmsh::write(&path, &mesh).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    // remove the elements of the middle part, whose volume has no group
    let elements = text.find("$Elements").unwrap();
    let block = text[elements..].find("\n3 3 4 ").unwrap() + elements + 1;
    let end = text[block..].find("\n3 4 4 ").unwrap() + block + 1;
    let count = text[block..end].lines().count() - 1;
    let mut forgotten = format!("{}{}", &text[..block], &text[end..]);
    let all = mesh.tets.len() + mesh.surfaces.values().map(Vec::len).sum::<usize>();
    forgotten = forgotten.replacen(
        &format!("$Elements\n7 {all} "),
        &format!("$Elements\n6 {} ", all - count),
        1,
    );
    let entity = forgotten.lines().find(|line| line.starts_with("3 -") && line.ends_with(" 1 3 0"));
    let entity = entity.unwrap().to_string();
    let untagged = format!("{} 0 0", entity.trim_end_matches(" 1 3 0"));
    forgotten = forgotten.replacen(&entity, &untagged, 1);
    let mut names = GmshNames::new([("matrix", 1)], [("bottom", 11)]);
    names.regions.insert("grain".into(), [2, 4].into());
    let (_dir, path) = file(&forgotten);
    let Imported { mesh: read, notes } = gmsh::import(&path, &names).unwrap();
    assert_eq!(read.tets.len(), mesh.tets.len() - count);
    let [ImportNote::Missing { volumes, cavities }] = &notes[..] else { panic!("{notes:?}") };
    let expected = mesh.region_volume("b").unwrap();
    assert_eq!((volumes.as_slice(), cavities.len()), (&[3][..], 1));
    assert!((cavities[0].volume_mm3 / expected - 1.0).abs() < 1e-9);
    let [x, y, z] = cavities[0].centre_mm;
    assert!(x.abs() < 0.1 && y.abs() < 0.1 && (2.1..2.4).contains(&z), "{:?}", cavities[0]);
    let message = notes[0].to_string();
    assert!(message.contains("a cavity inside") && message.contains("volume 3 of"), "{message}");
    assert!(
        gmsh::import(&path, &names).unwrap().mesh.cavities().len() == 1
            && mesh.cavities().is_empty()
    );

    // the note lists five of thirteen volumes without elements
    let (entity_start, entity_end) = untagged.split_once(' ').unwrap();
    assert_eq!(entity_start, "3");
    let further: String = (101..=112).map(|number| format!("\n{number} {entity_end}")).collect();
    let counts = forgotten.lines().skip_while(|line| *line != "$Entities").nth(1).unwrap();
    let volume_count: usize = counts.rsplit(' ').next().unwrap().parse().unwrap();
    let more = format!("{} {}", counts.rsplit_once(' ').unwrap().0, volume_count + 12);
    let many = forgotten.replacen(counts, &more, 1).replacen(
        &format!("{untagged}\n"),
        &format!("{untagged}{further}\n"),
        1,
    );
    let (_dir, path) = file(&many);
    let message = gmsh::import(&path, &names).unwrap().notes[0].to_string();
    let list = "volume 3, volume 101, volume 102, volume 103, volume 104 and 8 others of the geometry have no";
    assert!(message.contains(list), "{message}");
}

/// An error message about a group that is missing lists five of many groups.
#[test]
fn a_message_lists_five_of_many_groups() {
    let mut mesh = grouped();
    mesh.regions = (0..12).map(|n| format!("part {n}")).collect();
    for (tet, region) in mesh.region_of.iter_mut().enumerate() {
        *region = (tet % 12) as u16;
    }
    let (_dir, path) = file("");
    gmsh::write(&path, &mesh).unwrap();
    let names = GmshNames::new([("matrix", 99)], [("bottom", 11)]);
    let message = gmsh::read(&path, &names).unwrap_err().to_string();
    assert!(message.contains("5 (\"part 4\") and 7 others; "), "{message}");
    let names = GmshNames::new([("matrix", 1)], [("bottom", 11)]);
    let message = gmsh::read(&path, &names).unwrap_err().to_string();
    assert!(message.contains("and 6 others; list their physical group"), "{message}");
    let message = mesh.region_volume("absent").unwrap_err().to_string();
    assert!(message.ends_with("part 3, part 4 and 7 others"), "{message}");
}

#[test]
fn each_volume_is_one_block_and_the_order_is_preserved() {
    let mut mesh = grouped();
    // consecutive tetrahedra belong to different regions
    for (tet, region) in mesh.region_of.iter_mut().enumerate() {
        *region = (tet % 4) as u16;
    }
    let (_dir, path) = file("");
    gmsh::write(&path, &mesh).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut heads = text.lines().skip_while(|line| *line != "$Elements");
    assert!(heads.nth(1).unwrap().starts_with("7 "), "three surfaces and four volumes");
    let read = gmsh::read(&path, &GmshNames::default()).unwrap();
    assert!(read.tets == mesh.tets && read.region_of == mesh.region_of);
}
