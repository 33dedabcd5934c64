//! Tests of the cylinder lattice and of the validation of meshes.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use fem_mesh::{CylinderLattice, LatticeError, MeshError, Quality, TetMesh};

fn lattice(spacing_mm: f64) -> TetMesh {
    CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm }.build().unwrap()
}

/// Returns the number of wall nodes on the bottom edge.
fn wall_nodes(mesh: &TetMesh) -> usize {
    let on_bottom_rim = |p: &&[f64; 3]| p[2] == 0.0 && (p[0].hypot(p[1]) - 2.5).abs() < 1e-9;
    mesh.nodes.iter().filter(on_bottom_rim).count()
}

/// Returns the area vector of a triangle, along its outward normal.
fn area(mesh: &TetMesh, [a, b, c]: [u32; 3]) -> [f64; 3] {
    let [p, q, r] = [a, b, c].map(|node| nalgebra::Vector3::from(mesh.nodes[node as usize]));
    ((q - p).cross(&(r - p)) / 2.0).into()
}

#[test]
fn lattices_are_sound_and_well_shaped_at_every_spacing() {
    for spacing in [1.5, 1.2, 1.0, 0.7, 0.5, 0.4, 0.3, 0.22] {
        let mesh = lattice(spacing);
        mesh.validate().unwrap();
        let quality = Quality::of(&mesh);
        assert!(quality.min_dihedral_deg > 29.0, "spacing {spacing}: {quality}");
        assert!(quality.max_dihedral_deg < 150.0, "spacing {spacing}: {quality}");
    }
}

#[test]
fn volume_is_that_of_the_prism() {
    for spacing in [1.0, 0.7, 0.4] {
        let mesh = lattice(spacing);
        let corners = wall_nodes(&mesh) as f64;
        let polygon = 0.5 * corners * 2.5_f64.powi(2) * (2.0 * PI / corners).sin();
        let volume = mesh.volume();
        assert!((volume / (4.4 * polygon) - 1.0).abs() < 1e-13, "{volume} against {polygon}");
        assert_eq!(mesh.region_volume("matrix").unwrap(), volume);
    }
    // the volume error with respect to the cylinder is proportional to the square of the spacing
    let defect = |spacing| 1.0 - lattice(spacing).volume() / (PI * 2.5 * 2.5 * 4.4);
    assert!(defect(0.25) < 0.005 && defect(0.25) > 0.0);
}

#[test]
fn every_height_has_the_same_polygon() {
    let mesh = lattice(0.7);
    let ends = [-1.0, 1.0];
    for (name, sign) in ["bottom", "top"].into_iter().zip(ends) {
        let mut total = [0.0; 3];
        for &triangle in &mesh.surfaces[name] {
            let a = area(&mesh, triangle);
            (0..3).for_each(|k| total[k] += a[k]);
        }
        assert!((total[2] - sign * mesh.volume() / 4.4).abs() < 1e-12, "{name}: {total:?}");
    }
    // the wall is vertical everywhere
    for &triangle in &mesh.surfaces["side"] {
        assert!(area(&mesh, triangle)[2].abs() < 1e-14);
    }
}

#[test]
fn surfaces_cover_the_boundary_exactly() {
    let mesh = lattice(0.7);
    let listed: usize = mesh.surfaces.values().map(Vec::len).sum();
    assert_eq!(listed, mesh.boundary_faces().len());
    for (name, height) in [("bottom", 0.0), ("top", 4.4)] {
        for &node in mesh.surfaces[name].iter().flatten() {
            assert_eq!(mesh.nodes[node as usize][2], height);
        }
    }
    assert_eq!(mesh.tets.len(), 3040);
}

#[test]
fn element_count_follows_the_spacing() {
    for spacing in [0.5, 0.3, 0.2] {
        let wanted = 12.0 * PI * 2.5 * 2.5 * 4.4 / f64::powi(spacing, 3);
        let ratio = lattice(spacing).tets.len() as f64 / wanted;
        assert!((0.75..1.4).contains(&ratio), "spacing {spacing}: {ratio}");
    }
}

#[test]
fn impossible_lattices_say_what_to_do() {
    let build = |radius_mm, height_mm, spacing_mm| {
        CylinderLattice { radius_mm, height_mm, spacing_mm }.build().unwrap_err()
    };
    assert_eq!(build(2.5, f64::NAN, 0.7).to_string(), "height_mm = NaN mm; give a positive length");
    assert_eq!(
        build(-1.0, 4.4, 0.7),
        LatticeError::NotPositive { field: "radius_mm", value: -1.0 }
    );
    assert!(
        matches!(build(2.5, 4.4, 3.0), LatticeError::TooCoarse { most_mm, .. } if most_mm == 1.5)
    );
    assert!(matches!(build(2.5, 4.4, 1e-4), LatticeError::TooFine { .. }));
}

/// Returns a mesh of two tetrahedra that share a face.
fn pair() -> TetMesh {
    TetMesh {
        nodes: vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
        ],
        tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
        region_of: vec![0, 1],
        regions: vec!["matrix".into(), "grain".into()],
        grain_of: Some(vec![0, 1]),
        surfaces: BTreeMap::from([("bottom".into(), vec![[0, 2, 1]])]),
        ..TetMesh::default()
    }
}

#[test]
fn each_fault_is_named_with_its_entity() {
    pair().validate().unwrap();
    let fault = |spoil: &dyn Fn(&mut TetMesh)| {
        let mut mesh = pair();
        spoil(&mut mesh);
        mesh.validate().unwrap_err()
    };
    use MeshError as E;

    assert!(matches!(fault(&|m| m.tets.clear()), E::Empty));
    assert!(matches!(fault(&|m| m.nodes[3][1] = f64::NAN), E::NotFinite { node: 3, .. }));
    assert!(matches!(fault(&|m| m.tets[1][3] = 9), E::MissingNode { node: 9, nodes: 5, .. }));
    assert!(matches!(fault(&|m| m.nodes.push([2.0; 3])), E::UnusedNode { node: 5 }));
    assert!(matches!(fault(&|m| m.tets[1].swap(0, 1)), E::Inverted { tet: 1, .. }));
    assert!(matches!(fault(&|m| m.nodes[4] = [0.5, 0.25, 0.25]), E::Degenerate { tet: 1, .. }));
    assert!(matches!(
        fault(&|m| m.region_of.truncate(1)),
        E::Unlabelled { array: "region_of", length: 1, tets: 2 }
    ));
    assert!(matches!(
        fault(&|m| m.grain_of = Some(vec![])),
        E::Unlabelled { array: "grain_of", .. }
    ));
    assert!(matches!(fault(&|m| m.region_of[1] = 7), E::UnknownRegion { tet: 1, region: 7, .. }));
    assert!(matches!(fault(&|m| m.region_of[1] = 0), E::MissingRegion { name } if name == "grain"));
    // a third tetrahedron on the common face
    assert!(matches!(
        fault(&|m| {
            m.nodes.push([2.0, 2.0, 2.0]);
            m.tets.push([1, 2, 3, 5]);
            m.region_of.push(0);
            m.grain_of = None;
        }),
        E::NonManifoldFace { face: [1, 2, 3], count: 3, .. }
    ));
    // both tetrahedra on the same side of their common face
    assert!(matches!(
        fault(&|m| {
            m.nodes[4] = [-1.0, -1.0, -1.0];
            m.tets[1] = [1, 3, 2, 4];
        }),
        E::Overlap { first: 0, second: 1 }
    ));
    assert!(matches!(
        fault(&|m| {
            for k in 1..5 {
                let p = m.nodes[k];
                m.nodes.push(p);
            }
            m.tets[1] = [5, 6, 7, 8];
            m.nodes.remove(4);
            m.tets[1] = [4, 5, 6, 7];
        }),
        E::Disconnected { tet: 1 }
    ));
    assert!(matches!(
        fault(&|m| m.surfaces.get_mut("bottom").unwrap().push([1, 2, 3])),
        E::NotOnBoundary { triangle: 1, nodes: [1, 2, 3], .. }
    ));
    assert!(matches!(
        fault(&|m| m.surfaces.get_mut("bottom").unwrap()[0].swap(0, 1)),
        E::Inward { triangle: 0, .. }
    ));
    assert!(matches!(
        fault(&|m| drop(m.surfaces.insert("top".into(), vec![[2, 1, 0]]))),
        E::DuplicateTriangle { .. }
    ));
    assert!(matches!(
        fault(&|m| drop(m.surfaces.insert("top".into(), vec![]))),
        E::EmptySurface { name } if name == "top"
    ));
    assert!(matches!(pair().region_volume("void"), Err(E::NoSuchRegion { .. })));
}
