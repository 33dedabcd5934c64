//! Division of hexahedra into tetrahedra.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::mesh::TetMesh;
use crate::mesh::vector::{Point, mean};

/// The faces of a hexahedron, counter-clockwise seen from outside: bottom, top, front, right, back, left.
const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];
/// A path from corner 0 to corner 6 consists of three edges. Each entry contains the two corners between the ends of
/// one of the six paths. The four corners of a path form a tetrahedron.
const PATHS: [[usize; 2]; 6] = [[1, 2], [2, 3], [3, 7], [7, 4], [4, 5], [5, 1]];

/// Divides each hexahedron into six tetrahedra around its diagonal from corner 0 to corner 6. Neighbouring hexahedra of
/// a grid divide their common face by the same diagonal. The mesh has no surfaces.
pub(super) fn six(nodes: Vec<Point>, hexahedra: &[[u32; 8]]) -> TetMesh {
    let tets: Vec<[u32; 4]> = hexahedra
        .iter()
        .flat_map(|hex| PATHS.map(|[a, b]| [hex[0], hex[a], hex[b], hex[6]]))
        .collect();
    mesh(nodes, tets)
}

/// Divides each hexahedron into twelve tetrahedra: each inner face and the centres of its two hexahedra form four
/// tetrahedra. A boundary face has only one hexahedron; the centre of the face replaces the centre of the second
/// hexahedron. `sides` contains the names of the surfaces for boundary faces on the bottom, top, front, right, back and
/// left of a hexahedron.
pub(super) fn twelve(mut nodes: Vec<Point>, hexahedra: &[[u32; 8]], sides: [&str; 6]) -> TetMesh {
    let mut faces: Vec<HexFace> = Vec::with_capacity(6 * hexahedra.len());
    for hex in hexahedra {
        let centre = nodes.len() as u32;
        nodes.push(mean(hex.iter().map(|&node| nodes[node as usize])));
        for (side, local) in FACES.iter().enumerate() {
            faces.push(HexFace::new(local.map(|l| hex[l]), centre, side));
        }
    }
    faces.par_sort_unstable_by_key(|face| (face.key, face.centre));

    let mut tets = Vec::new();
    let mut surfaces: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
    for shared in faces.chunk_by(|a, b| a.key == b.key) {
        let HexFace { outward, centre, side, .. } = shared[0];
        let apex = match shared.get(1) {
            Some(other) => other.centre,
            None => {
                nodes.push(mean(outward.iter().map(|&node| nodes[node as usize])));
                nodes.len() as u32 - 1
            }
        };
        for k in 0..4 {
            let edge = [outward[k], outward[(k + 1) % 4]];
            tets.push([centre, edge[0], edge[1], apex]);
            if shared.len() == 1 {
                surfaces.entry(sides[side].into()).or_default().push([edge[0], edge[1], apex]);
            }
        }
    }
    TetMesh { surfaces, ..mesh(nodes, tets) }
}

fn mesh(nodes: Vec<Point>, tets: Vec<[u32; 4]>) -> TetMesh {
    TetMesh {
        region_of: vec![0; tets.len()],
        regions: vec!["matrix".into()],
        nodes,
        tets,
        ..TetMesh::default()
    }
}

/// A face of one hexahedron.
struct HexFace {
    /// Nodes of the face in increasing order.
    key: [u32; 4],
    /// Nodes of the face, counter-clockwise seen from outside.
    outward: [u32; 4],
    /// Node at the centre of the hexahedron.
    centre: u32,
    /// Index of the face in [`FACES`].
    side: usize,
}

impl HexFace {
    fn new(outward: [u32; 4], centre: u32, side: usize) -> HexFace {
        let mut key = outward;
        key.sort_unstable();
        HexFace { key, outward, centre, side }
    }
}
