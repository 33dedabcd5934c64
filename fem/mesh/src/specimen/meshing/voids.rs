//! Removal of the tetrahedra in voids from a mesh.

use std::collections::BTreeSet;

use crate::mesh::TetMesh;
use crate::mesh::topology::{EdgePoint, sorted};
use fem_image::DisjointSets;

/// Result of the removal of voids from a mesh.
pub(super) struct Carved {
    /// For each tetrahedron of the original mesh, whether it remains.
    pub(super) stays: Vec<bool>,
    /// Number of tetrahedra in voids.
    pub(super) void_tets: usize,
    /// Number of tetrahedra outside voids that were removed because no face connects them with the body.
    pub(super) loose_tets: usize,
}

/// Removes the void tetrahedra from a mesh that has no regions yet. Only the largest part that is connected through
/// faces remains: a part without a face in common with the body could rotate without resistance.
///
/// Named surfaces keep the triangles that belong to the remaining body; the boundaries of voids belong to no named
/// surface. If the remaining body has no triangle on one of the named surfaces, the mesh is not changed and the result
/// is `None`.
pub(super) fn carve(mesh: &mut TetMesh, is_void: &[bool]) -> Option<Carved> {
    let stays = largest_part(mesh, is_void);
    let remains = |tet: &usize| stays[*tet];
    let mut carved = TetMesh {
        nodes: mesh.nodes.clone(),
        tets: (0..mesh.tets.len()).filter(remains).map(|tet| mesh.tets[tet]).collect(),
        mixture: mesh
            .mixture
            .as_ref()
            .map(|all| (0..all.len()).filter(remains).map(|tet| all[tet]).collect()),
        ..TetMesh::default()
    };
    let faces: BTreeSet<[u32; 3]> = carved.boundary_faces().into_iter().map(sorted).collect();
    for (name, triangles) in &mesh.surfaces {
        let remaining: Vec<[u32; 3]> = triangles
            .iter()
            .copied()
            .filter(|&triangle| faces.contains(&sorted(triangle)))
            .collect();
        if remaining.is_empty() {
            return None;
        }
        carved.surfaces.insert(name.clone(), remaining);
    }
    let edges = carved.edges();
    let exists = |(edge, _): &EdgePoint| edges.binary_search(edge).is_ok();
    carved.edge_points = mesh.edge_points.iter().copied().filter(exists).collect();
    let loose = (0..stays.len()).filter(|&tet| !stays[tet] && !is_void[tet]).count();
    let void_tets = is_void.iter().filter(|void| **void).count();
    *mesh = carved.without_unused_nodes();
    Some(Carved { stays, void_tets, loose_tets: loose })
}

/// Returns a mark for each tetrahedron of the largest part outside the voids. A part consists of tetrahedra that are
/// connected through faces.
fn largest_part(mesh: &TetMesh, is_void: &[bool]) -> Vec<bool> {
    let mut connected = DisjointSets::new(mesh.tets.len());
    for [a, b] in mesh.neighbours() {
        if !is_void[a as usize] && !is_void[b as usize] {
            connected.join(a, b);
        }
    }
    let roots: Vec<usize> =
        (0..mesh.tets.len() as u32).map(|tet| connected.root(tet) as usize).collect();
    let mut volumes = vec![0.0; mesh.tets.len()];
    for (tet, volume) in mesh.volumes().into_iter().enumerate().filter(|&(tet, _)| !is_void[tet]) {
        volumes[roots[tet]] += volume;
    }
    let largest =
        (0..volumes.len()).max_by(|&a, &b| volumes[a].total_cmp(&volumes[b]).then(b.cmp(&a)));
    roots.iter().zip(is_void).map(|(root, void)| !void && Some(*root) == largest).collect()
}
