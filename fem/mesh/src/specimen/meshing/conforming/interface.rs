//! Interfaces of a labelled mesh: nodes on interfaces, nodes that may move, and the constraints of nodes.

use rayon::prelude::*;

use super::Conforming;
use crate::mesh::TetMesh;
use crate::mesh::groups::Groups;
use crate::mesh::topology::FACES;
use crate::specimen::meshing::adjacency::Adjacency;

/// Number of rings of nodes around an interface in which nodes move. Ring k consists of the nodes that are k edges away
/// from the interface.
const RINGS: u8 = 2;
/// Ring number of a node that is farther from all interfaces than the last ring and does not move.
const RESTS: u8 = u8::MAX;

/// Constraints of the movement of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Held {
    /// Whether the node stays on the wall.
    pub(super) wall: bool,
    /// Whether the node stays on an edge of the wall of a prism.
    pub(super) corner: bool,
    /// Whether the node stays in the plane of an end.
    pub(super) end: bool,
}

/// The interfaces of a labelled mesh, and the nodes that move.
pub(super) struct Interface {
    /// For each node on an interface, the labels of the tetrahedra around the node in increasing order; empty for all
    /// other nodes.
    pub(super) labels: Groups,
    /// For each node on an interface, its neighbours on the interface: the other nodes of the interface triangles at
    /// the node. A neighbour is repeated for each triangle.
    pub(super) neighbours: Groups,
    /// Constraints of each node.
    pub(super) held: Vec<Held>,
    /// Ring number of each node: the number of edges between the node and the nearest interface; 0 on an interface.
    pub(super) ring: Vec<u8>,
    /// Triangles between tetrahedra with different labels, each with both labels (the smaller label first).
    pub(super) triangles: Vec<([u32; 3], [u32; 2])>,
    /// Groups of the nodes that move. Two nodes of the same group share no tetrahedron, so that they can be moved in
    /// parallel.
    pub(super) groups: Vec<Vec<u32>>,
}

impl Interface {
    pub(super) fn new(
        how: &Conforming,
        mesh: &TetMesh,
        around: &Adjacency,
        faces: &[[u32; 2]],
        labels: &[u32],
    ) -> Interface {
        let triangles = triangles(mesh, faces, labels);
        let nodes = mesh.nodes.len();
        let labels_of = |node: usize| {
            let tets = around.tets_of(node).iter();
            let mut distinct: Vec<u32> = tets.map(|&tet| labels[tet as usize]).collect();
            distinct.sort_unstable();
            distinct.dedup();
            if distinct.len() > 1 { distinct } else { Vec::new() }
        };
        let labels =
            Groups::from_lists(&(0..nodes).into_par_iter().map(labels_of).collect::<Vec<_>>());
        let mut neighbours = vec![Vec::new(); nodes];
        for &(triangle, _) in &triangles {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
                neighbours[a as usize].extend([b, c]);
            }
        }
        let neighbours = Groups::from_lists(&neighbours);
        let ring = rings(mesh, &labels);
        let groups = groups(mesh, around, &ring);
        Interface { labels, neighbours, held: held(how, mesh), ring, triangles, groups }
    }
}

/// Returns the triangles between tetrahedra with different labels, each with both labels (the smaller label first).
fn triangles(mesh: &TetMesh, faces: &[[u32; 2]], labels: &[u32]) -> Vec<([u32; 3], [u32; 2])> {
    let between = |&[a, b]: &[u32; 2]| {
        let [one, other] = [a, b].map(|tet| labels[tet as usize]);
        if one == other {
            return None;
        }
        let (mine, theirs) = (mesh.tets[a as usize], mesh.tets[b as usize]);
        let face = FACES
            .map(|face| face.map(|corner| mine[corner]))
            .into_iter()
            .find(|face| face.iter().all(|node| theirs.contains(node)))?;
        Some((face, [one.min(other), one.max(other)]))
    };
    faces.par_iter().filter_map(between).collect()
}

/// Returns the ring number of each node: the number of edges between the node and the nearest interface.
fn rings(mesh: &TetMesh, labels: &Groups) -> Vec<u8> {
    let mut ring: Vec<u8> = (0..mesh.nodes.len())
        .map(|node| if labels.of(node).is_empty() { RESTS } else { 0 })
        .collect();
    for distance in 1..=RINGS {
        let mut next = ring.clone();
        for tet in &mesh.tets {
            if tet.iter().any(|&node| ring[node as usize] == distance - 1) {
                for &node in tet.iter().filter(|&&node| ring[node as usize] == RESTS) {
                    next[node as usize] = distance;
                }
            }
        }
        ring = next;
    }
    ring
}

/// Divides the nodes that move into groups (colours) by greedy graph colouring: each node gets the first colour that no
/// neighbouring node has.
fn groups(mesh: &TetMesh, around: &Adjacency, ring: &[u8]) -> Vec<Vec<u32>> {
    let mut colour = vec![u8::MAX; mesh.nodes.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for node in (0..mesh.nodes.len()).filter(|&node| ring[node] != RESTS) {
        let mut used_colours = 0_u128;
        for &tet in around.tets_of(node) {
            for &other in &mesh.tets[tet as usize] {
                let colour = colour[other as usize];
                if colour != u8::MAX {
                    used_colours |= 1 << colour;
                }
            }
        }
        let free = used_colours.trailing_ones() as usize;
        colour[node] = free as u8;
        if groups.len() <= free {
            groups.push(Vec::new());
        }
        groups[free].push(node as u32);
    }
    groups
}

/// Returns the constraints of each node.
fn held(how: &Conforming, mesh: &TetMesh) -> Vec<Held> {
    let mut held = vec![Held::default(); mesh.nodes.len()];
    for (name, triangles) in &mesh.surfaces {
        for &node in triangles.as_flattened() {
            let held = &mut held[node as usize];
            match name == "side" {
                true => held.wall = true,
                false => held.end = true,
            }
        }
    }
    for (held, &[x, y, _]) in held.iter_mut().zip(&mesh.nodes).filter(|(held, _)| held.wall) {
        let (radius, wall) = (x.hypot(y), how.wall.radius_at(x, y));
        debug_assert!(
            (radius - wall).abs() < 1e-9 * wall,
            "a node at {radius}, the wall at {wall}"
        );
        held.corner = how.wall.is_corner(x, y);
    }
    held
}
