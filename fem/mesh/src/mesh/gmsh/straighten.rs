//! Repair of imported curved tetrahedra: correct orientation, and straight edges for folded tetrahedra.

use rayon::prelude::*;

use crate::mesh::TetMesh;
use crate::mesh::curved::Jacobian;
use crate::mesh::topology::edges_of;

/// Orders the nodes of each tetrahedron so that its volume, curved edges included, is positive.
pub(super) fn orient(mesh: &mut TetMesh) {
    let turned: Vec<bool> =
        (0..mesh.tets.len()).into_par_iter().map(|tet| mesh.tet_volume(tet) < 0.0).collect();
    for (tet, _) in mesh.tets.iter_mut().zip(turned).filter(|(_, turned)| *turned) {
        tet.swap(0, 1);
    }
}

/// Orients the tetrahedra and straightens all edges of folded tetrahedra. Straightening can fold neighbours, so both
/// steps are repeated until no tetrahedron is folded. Returns the sorted numbers of the straightened tetrahedra.
pub(super) fn straighten(mesh: &mut TetMesh) -> Vec<u32> {
    orient(mesh);
    let mut straightened = Vec::new();
    loop {
        let is_folded = |tet: &usize| match mesh.middles(*tet) {
            // a determinant of NaN does not count as folded, because the validation of the mesh rejects such points
            // later
            Some(middles) => Jacobian::of(&mesh.corners(*tet), &middles).lowest <= 0.0,
            None => false,
        };
        let folded: Vec<usize> = (0..mesh.tets.len()).into_par_iter().filter(is_folded).collect();
        if folded.is_empty() {
            straightened.sort_unstable();
            return straightened;
        }
        let mut edges: Vec<[u32; 2]> =
            folded.iter().flat_map(|&tet| edges_of(&mesh.tets[tet])).collect();
        edges.sort_unstable();
        mesh.edge_points.retain(|(edge, _)| edges.binary_search(edge).is_err());
        straightened.extend(folded.iter().map(|&tet| tet as u32));
        orient(mesh);
    }
}
