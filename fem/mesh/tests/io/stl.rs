//! STL surfaces: they are closed, oriented outwards, and enclose the volume of their tetrahedra.

use std::collections::{BTreeMap, BTreeSet};

use fem_mesh::stl::{self, Triangle};
use fem_mesh::{
    CylinderLattice, GrainList, GrainMode, Meshing, Packing, SizeClass, TetMesh, label,
};

fn specimen() -> TetMesh {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.35 };
    let mut mesh = lattice.build().unwrap();
    label(&mut mesh, &Packing::new(0.2, 3).fill(2.5, 4.4).unwrap());
    mesh
}

/// Counts each directed edge; corners are identical if their coordinates have the same bits.
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

/// Asserts that each edge has as many triangles in one direction as in the other; returns the number of edges shared
/// by more than two triangles.
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
    let volumes = grain_volumes(&mesh);
    assert!(surfaces.len() > 10 && surfaces.keys().eq(volumes.keys()));
    let mut pinched = 0;
    for (grain, surface) in &surfaces {
        pinched += usize::from(assert_closed(surface) > 0);
        let (enclosed, expected): (f64, f64) = (stl::enclosed_volume(surface), volumes[grain]);
        assert!((enclosed / expected - 1.0).abs() < 1e-12, "{grain}: {enclosed} {expected} mm³");
    }
    // tetrahedra of one grain may be connected by an edge only
    assert!(4 * pinched < surfaces.len(), "{pinched} of {} grains", surfaces.len());
    let whole = stl::specimen(&mesh);
    assert_eq!(assert_closed(&whole), 0, "two triangles at every edge");
    assert!((stl::enclosed_volume(&whole) / mesh.volume() - 1.0).abs() < 1e-12);
}

/// Returns the volume of each grain, summed over its tetrahedra.
fn grain_volumes(mesh: &TetMesh) -> BTreeMap<u32, f64> {
    let mut volumes = BTreeMap::new();
    for (tet, &grain) in mesh.grain_of.iter().flatten().enumerate().filter(|(_, g)| **g > 0) {
        *volumes.entry(grain).or_default() += mesh.tet_volume(tet);
    }
    volumes
}

#[test]
fn conforming_grains_are_closed_outward_and_as_large_as_in_the_mesh() {
    // grains in contact: some faces belong to two grains, with opposite orientations
    let sizes = vec![SizeClass { median_radius_mm: 0.3, spread: 0.1, share: 1.0 }];
    let packing = Packing { film_mm: 0.0, sizes, ..Packing::new(0.45, 5) };
    let grains = GrainList::new(packing.fill(1.0, 1.6).unwrap(), 1.0, 1.6);
    let meshing = Meshing { mode: GrainMode::Conforming, ..Meshing::new(0.15) };
    let mut mesh = meshing.build(1.0, 1.6, &grains).unwrap().mesh;
    assert!(!mesh.edge_points.is_empty());
    let (curved, in_mesh) = (stl::grains(&mesh), grain_volumes(&mesh));
    mesh.edge_points.clear();
    let (straight, in_straight) = (stl::grains(&mesh), grain_volumes(&mesh));
    assert!(straight.len() > 10 && straight.keys().eq(in_straight.keys()));
    assert!(curved.keys().eq(straight.keys()));

    let faces = |surface: &[Triangle]| -> BTreeSet<[[u64; 3]; 3]> {
        let corners = surface.iter().map(|triangle| triangle.map(|p| p.map(f64::to_bits)));
        corners
            .map(|c| (0..3).map(|k| [c[k], c[(k + 1) % 3], c[(k + 2) % 3]]).min().unwrap())
            .collect()
    };
    let mut shared = 0;
    let [mut bulges, mut more] = [0.0_f64; 2];
    for (grain, flat) in &straight {
        assert_closed(flat);
        assert_closed(&curved[grain]);
        let (enclosed, expected): (f64, f64) = (stl::enclosed_volume(flat), in_straight[grain]);
        assert!((enclosed / expected - 1.0).abs() < 1e-12, "{grain}: {enclosed} {expected} mm³");
        let round = stl::enclosed_volume(&curved[grain]);
        let between = expected + 0.75 * (in_mesh[grain] - expected);
        assert!((round / between - 1.0).abs() < 0.003, "{grain}: {round}, about {between} mm³");
        bulges += in_mesh[grain] - expected;
        more += round - enclosed;
        let reversed: Vec<Triangle> = flat.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let others = straight.iter().filter(|(other, _)| *other > grain);
        for (_, other) in others {
            shared += faces(&reversed).intersection(&faces(other)).count();
        }
    }
    assert!(shared > 20, "{shared} faces between grains");
    // the volume between a quadratic face and its plane is its area times the mean height of its mid-edge nodes; the
    // four triangles enclose three quarters of this volume, up to products of heights
    assert!((more / bulges - 0.75).abs() < 0.02, "{more} of {bulges} mm³");
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
    let values: Vec<f32> = (0..12).map(number).collect();
    assert_eq!(values, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0]);
    let error = stl::write("nowhere/a.stl", "", &surface).unwrap_err();
    assert!(error.to_string().contains("nowhere"), "{error}");
}
