//! Mid-edge nodes of Gmsh's second-order elements.

use crate::mesh::topology::{EdgePoint, key, middle};
use crate::mesh::vector::{Point, norm, sub};

/// The edges of a tetrahedron in the order of Gmsh. VTK swaps the last two edges.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]];
/// An edge is straight if the distance of its mid-edge node from its midpoint is at most this factor times the length
/// of the edge. The factor exceeds the rounding error of coordinates written with 16 digits.
const STRAIGHT: f64 = 1e-12;

/// Returns the curved edges with their mid-edge points (mm), sorted by nodes. `tets` yields the corners and the
/// mid-edge nodes of each tetrahedron. If an edge has different mid-edge nodes in two tetrahedra, the error is this
/// edge.
pub(super) fn curved_edges<'a>(
    positions: &[Point],
    tets: impl Iterator<Item = (&'a [u32; 4], &'a [u32; 6])>,
) -> Result<Vec<EdgePoint>, [u32; 2]> {
    let mut all: Vec<EdgePoint> = tets
        .flat_map(|(corners, middles)| {
            EDGES
                .iter()
                .zip(middles)
                .map(|(ends, &node)| (key(ends.map(|end| corners[end])), positions[node as usize]))
        })
        .collect();
    all.sort_by_key(|&(edge, _)| edge);
    if let Some(pair) = all.windows(2).find(|w| w[0].0 == w[1].0 && w[0].1 != w[1].1) {
        return Err(pair[0].0);
    }
    all.dedup_by_key(|(edge, _)| *edge);
    all.retain(|&(edge, point)| {
        let [p, q] = edge.map(|node| positions[node as usize]);
        let deviation = norm(sub(point, middle(positions, edge)));
        // do not drop a point that is not finite, so that the validation of the mesh reports this point
        deviation.is_nan() || deviation > STRAIGHT * norm(sub(q, p))
    });
    Ok(all)
}
