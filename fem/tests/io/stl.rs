//! STL surfaces: closed, outward, and as large as the tetrahedra that they enclose.

use std::collections::BTreeMap;

use fem::stl::{self, Triangle};
use fem::{CylinderLattice, Packing, TetMesh, label};

fn specimen() -> TetMesh {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.35 };
    let mut mesh = lattice.build().unwrap();
    label(&mut mesh, &Packing::new(0.2, 3).fill(2.5, 4.4).unwrap());
    mesh
}

/// How often each directed edge occurs; corners are the same where their bits are.
fn edges(surface: &[Triangle]) -> BTreeMap<[[u64; 3]; 2], usize> {
    let mut count = BTreeMap::new();
    for triangle in surface {
        let corner = triangle.map(|p| p.map(f64::to_bits));
        for ends in [[0, 1], [1, 2], [2, 0]] {
            *count.entry(ends.map(|end| corner[end])).or_default() += 1;
        }
    }
    count
}

/// Every edge is shared by triangles that run along it in opposite senses; how many edges more than two
/// triangles share.
fn assert_closed(surface: &[Triangle]) -> usize {
    let edges = edges(surface);
    for (&[a, b], count) in &edges {
        assert_eq!(edges.get(&[b, a]), Some(count), "an edge is open");
    }
    edges.values().filter(|&&count| count > 1).count()
}

#[test]
fn grains_are_closed_outward_and_as_large_as_their_tetrahedra() {
    let mesh = specimen();
    let surfaces = stl::grains(&mesh);
    let grain_of = mesh.grain_of.as_ref().unwrap();
    let mut volumes = BTreeMap::new();
    for (tet, &grain) in grain_of.iter().enumerate().filter(|(_, g)| **g > 0) {
        *volumes.entry(grain).or_default() += mesh.tet_volume(tet);
    }
    assert!(surfaces.len() > 10 && surfaces.keys().eq(volumes.keys()));
    let mut pinched = 0;
    for (grain, surface) in &surfaces {
        pinched += usize::from(assert_closed(surface) > 0);
        let (enclosed, expected): (f64, f64) = (stl::enclosed_volume(surface), volumes[grain]);
        assert!((enclosed / expected - 1.0).abs() < 1e-12, "{grain}: {enclosed} {expected} mm³");
    }
    // tetrahedra of one grain may meet in an edge alone
    assert!(4 * pinched < surfaces.len(), "{pinched} of {} grains", surfaces.len());
    let whole = stl::specimen(&mesh);
    assert_eq!(assert_closed(&whole), 0, "two triangles at every edge");
    assert!((stl::enclosed_volume(&whole) / mesh.volume() - 1.0).abs() < 1e-12);
}

#[test]
fn a_round_wall_is_rounder_than_its_corners() {
    let mut mesh =
        CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build().unwrap();
    let flat = stl::enclosed_volume(&stl::specimen(&mesh));
    let mut chords: Vec<([u32; 2], [f64; 3])> = Vec::new();
    for triangle in &mesh.surfaces["side"] {
        for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|ends| ends.map(|end| triangle[end])) {
            let [p, q] = [a, b].map(|node| mesh.nodes[node as usize]);
            let [x, y, z]: [f64; 3] = std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
            let scale = 2.5 / x.hypot(y);
            if a < b && scale > 1.0 + 1e-9 {
                chords.push(([a, b], [scale * x, scale * y, z]));
            }
        }
    }
    chords.sort_by_key(|(edge, _)| *edge);
    chords.dedup_by_key(|(edge, _)| *edge);
    mesh.edge_points = chords;
    mesh.validate().unwrap();
    let surface = stl::specimen(&mesh);
    assert_eq!(assert_closed(&surface), 0);
    let (round, exact) = (stl::enclosed_volume(&surface), std::f64::consts::PI * 6.25 * 4.4);
    assert!((exact - round) < 0.3 * (exact - flat), "{flat}, {round}, exactly {exact} mm³");
}

#[test]
fn the_file_is_binary_stl() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.stl");
    let surface = [[[0.0; 3], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0]]; 2];
    stl::write(&path, &"a long title ".repeat(20), &surface).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(bytes.len(), 84 + 2 * 50);
    assert!(!bytes.starts_with(b"solid"));
    assert_eq!(bytes[80..84], 2_u32.to_le_bytes());
    let number = |k: usize| f32::from_le_bytes(bytes[84 + 4 * k..][..4].try_into().unwrap());
    let numbers: Vec<f32> = (0..12).map(number).collect();
    assert_eq!(numbers, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0]);
    let error = stl::write("nowhere/a.stl", "", &surface).unwrap_err();
    assert!(error.to_string().contains("nowhere"), "{error}");
}
