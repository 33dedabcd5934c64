//! Faces and edges of a tetrahedron, and mid-edge points of quadratic elements.

use super::vector::{Point, add, scale};

/// The faces of a tetrahedron, each given by its three corners (0 to 3), counter-clockwise seen from outside.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
/// The edges of a tetrahedron, each given by its two corners (0 to 3).
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// An edge, with the smaller node first, and its mid-edge point (mm).
pub(crate) type EdgePoint = ([u32; 2], Point);

/// Returns an edge with its smaller node first.
pub(crate) fn key([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the edges of a tetrahedron, each with its smaller node first.
pub(crate) fn edges_of(tet: &[u32; 4]) -> [[u32; 2]; 6] {
    EDGES.map(|ends| key(ends.map(|end| tet[end])))
}

/// Returns the nodes of a face in increasing order.
pub(crate) fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Returns whether two triangles with the same nodes have the same orientation (one is an even permutation of the
/// other).
pub(crate) fn is_even_turn(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|k| b == [a[k], a[(k + 1) % 3], a[(k + 2) % 3]])
}

/// Returns the midpoint of a straight edge.
pub(crate) fn middle(positions: &[Point], edge: [u32; 2]) -> Point {
    let [p, q] = edge.map(|node| positions[node as usize]);
    scale(add(p, q), 0.5)
}

/// Returns the index of an edge in the sorted list of all edges of the mesh.
pub(crate) fn edge_index(edges: &[EdgePoint], ends: [u32; 2]) -> usize {
    let index = edges.binary_search_by_key(&key(ends), |(edge, _)| *edge);
    index.expect("every edge of the mesh is listed")
}
