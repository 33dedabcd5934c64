//! The edges of a mesh and their mid-edge points for quadratic elements.

use super::TetMesh;
use super::tet_mesh::EDGES;
use super::vector::{Point, add, scale};

/// An edge, with the smaller node first, and its mid-edge point (mm).
pub(super) type EdgePoint = ([u32; 2], Point);

/// Returns the midpoint of a straight edge.
pub(super) fn middle(points: &[Point], edge: [u32; 2]) -> Point {
    let [p, q] = edge.map(|node| points[node as usize]);
    scale(add(p, q), 0.5)
}

/// Returns an edge with its smaller node first.
pub(super) fn key([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the index of an edge in the sorted list of all edges of the mesh.
pub(super) fn edge_place(edges: &[EdgePoint], ends: [u32; 2]) -> usize {
    let found = edges.binary_search_by_key(&key(ends), |(edge, _)| *edge);
    found.expect("every edge of the mesh is listed")
}

impl TetMesh {
    /// Returns all edges with their mid-edge points, curved or straight, sorted by node numbers.
    pub(super) fn all_edges(&self) -> Vec<EdgePoint> {
        let ends = |tet: &[u32; 4]| EDGES.map(|ends| key(ends.map(|end| tet[end])));
        let mut edges: Vec<[u32; 2]> = self.tets.iter().flat_map(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut curved = self.edge_points.iter().peekable();
        let point = |edge: [u32; 2]| match curved.next_if(|(of, _)| *of == edge) {
            Some(&curved) => curved,
            None => (edge, middle(&self.nodes, edge)),
        };
        edges.into_iter().map(point).collect()
    }
}
