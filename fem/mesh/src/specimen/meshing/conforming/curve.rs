//! Mid-edge points of the curved edges on interfaces and on the wall of the cylinder.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Conforming;
use super::interface::{Held, Interface};
use super::relocate::{Pull, Relocation};
use crate::mesh::TetMesh;
use crate::mesh::curved::Jacobian;
use crate::mesh::topology::EDGES;
use crate::mesh::vector::{Point, add, mean, norm, scale, sub, tet_volume};

/// Smallest allowed Jacobian determinant of a curved tetrahedron, relative to the determinant of the tetrahedron with
/// straight edges.
const LEAST: f64 = 0.3;
/// Number of times that the bend of an edge is halved if the edge would otherwise fold a tetrahedron. If this is not
/// sufficient, the edge becomes straight.
const HALVINGS: usize = 4;
/// Largest bend of an edge (displacement of its midpoint), relative to its length.
const FARTHEST: f64 = 0.2;
/// An edge counts as straight if its bend (displacement of its midpoint) is below this value, relative to the spacing.
const STRAIGHT: f64 = 1e-6;

/// An edge that may be curved.
struct Edge {
    nodes: [u32; 2],
    /// Labels of the grains and the matrix that meet along the edge; empty for an edge that lies on the wall but on no
    /// interface.
    labels: Vec<u32>,
    /// Constraints of the movement of the mid-edge point.
    held: Held,
}

/// The edges that may be curved, and the tetrahedra that have such edges.
pub(super) struct EdgePoints {
    edges: Vec<Edge>,
    /// Tetrahedra with edges that may be curved: number of the tetrahedron, and the indices of its six edges in `edges`
    /// ([`STAYS`] for an edge that stays straight).
    tets: Vec<(u32, [u32; 6])>,
}

/// Placeholder for the index of an edge that stays straight.
const STAYS: u32 = u32::MAX;

impl EdgePoints {
    pub(super) fn new(how: &Conforming, mesh: &TetMesh, interface: &Interface) -> EdgePoints {
        if !(how.curved || how.curved_wall) {
            return EdgePoints { edges: Vec::new(), tets: Vec::new() };
        }
        let mut edge_map: BTreeMap<[u32; 2], Edge> = BTreeMap::new();
        let key = |a: u32, b: u32| [a.min(b), a.max(b)];
        let sides = |[a, b, c]: [u32; 3]| [key(a, b), key(b, c), key(c, a)];
        for (name, triangles) in &mesh.surfaces {
            for nodes in triangles.iter().flat_map(|&triangle| sides(triangle)) {
                let edge = edge_map.entry(nodes).or_insert(Edge {
                    nodes,
                    labels: vec![],
                    held: Held::default(),
                });
                match name == "side" {
                    true => edge.held.wall = true,
                    false => edge.held.end = true,
                }
            }
        }
        for &(triangle, pair) in &interface.triangles {
            for nodes in sides(triangle) {
                let edge = edge_map.entry(nodes).or_insert(Edge {
                    nodes,
                    labels: vec![],
                    held: Held::default(),
                });
                edge.labels.extend(pair);
                edge.labels.sort_unstable();
                edge.labels.dedup();
            }
        }
        // edges that lie in an end plane and on no interface stay straight
        edge_map.retain(|_, edge| {
            (how.curved_wall && edge.held.wall) || (how.curved && !edge.labels.is_empty())
        });
        for edge in edge_map.values_mut().filter(|edge| edge.held.wall) {
            let [a, b] = edge.nodes.map(|node| mesh.nodes[node as usize]);
            edge.held.corner = how.wall.is_corner(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]));
        }
        let number: BTreeMap<[u32; 2], u32> = edge_map.keys().copied().zip(0..).collect();
        let of_tet = |(tet, nodes): (usize, &[u32; 4])| {
            let edges = EDGES.map(|edge| {
                let [a, b] = edge.map(|corner| nodes[corner]);
                number.get(&key(a, b)).copied().unwrap_or(STAYS)
            });
            (edges != [STAYS; 6]).then_some((tet as u32, edges))
        };
        let tets = mesh.tets.par_iter().enumerate().filter_map(of_tet).collect();
        EdgePoints { edges: edge_map.into_values().collect(), tets }
    }

    /// Returns the bend of each edge (displacement of its midpoint, mm), limited so that no tetrahedron folds, and the
    /// number of edges that had to stay straight to avoid a folded tetrahedron.
    fn bends(&self, at: &Relocation) -> (Vec<Point>, usize) {
        let wanted: Vec<Point> = self.edges.par_iter().map(|edge| bend(at, edge)).collect();
        let mut part = vec![1.0; wanted.len()];
        for halving in 0.. {
            let folded = |(tet, edges): &(u32, [u32; 6])| {
                let corners = at.mesh.tets[*tet as usize].map(|node| at.nodes[node as usize]);
                let middles = middles(&corners, edges, |edge| scale(wanted[edge], part[edge]));
                let least = LEAST * 6.0 * tet_volume(corners);
                (Jacobian::of(&corners, &middles).lowest < least).then_some(*edges)
            };
            let mut folded: Vec<u32> =
                self.tets.par_iter().filter_map(folded).flatten_iter().collect();
            folded.retain(|&edge| edge != STAYS && part[edge as usize] > 0.0);
            if folded.is_empty() {
                break;
            }
            folded.sort_unstable();
            folded.dedup();
            for edge in folded {
                part[edge as usize] *= if halving < HALVINGS { 0.5 } else { 0.0 };
            }
        }
        let straightened = part.iter().filter(|&&part| part == 0.0).count();
        (wanted.iter().zip(&part).map(|(&bend, &part)| scale(bend, part)).collect(), straightened)
    }

    /// Returns the volume of each grain (mm³), curved edges included.
    pub(super) fn volumes(&self, at: &Relocation, labels: &[u32]) -> Vec<f64> {
        let mut of_tet: Vec<f64> = at
            .mesh
            .tets
            .par_iter()
            .map(|tet| tet_volume(tet.map(|node| at.nodes[node as usize])))
            .collect();
        if !self.edges.is_empty() {
            let (bends, _) = self.bends(at);
            let volume = |(tet, edges): &(u32, [u32; 6])| {
                let corners = at.mesh.tets[*tet as usize].map(|node| at.nodes[node as usize]);
                let middles = middles(&corners, edges, |edge| bends[edge]);
                (*tet, Jacobian::of(&corners, &middles).mean / 6.0)
            };
            let curved: Vec<(u32, f64)> = self.tets.par_iter().map(volume).collect();
            curved.into_iter().for_each(|(tet, volume)| of_tet[tet as usize] = volume);
        }
        let mut volumes = vec![0.0; at.offsets.len()];
        for (&label, volume) in labels.iter().zip(of_tet).filter(|(label, _)| **label > 0) {
            volumes[label as usize - 1] += volume;
        }
        volumes
    }

    /// Returns the mid-edge points of the mesh, and the number of edges that stayed straight to avoid a folded
    /// tetrahedron.
    pub(super) fn edge_points(&self, at: &Relocation) -> (Vec<([u32; 2], Point)>, usize) {
        let (bends, straightened) = self.bends(at);
        let edge_points = self.edges.iter().zip(bends).filter_map(|(edge, bend)| {
            let [a, b] = edge.nodes.map(|node| at.nodes[node as usize]);
            let bends = norm(bend) > STRAIGHT * at.how.spacing_mm;
            bends.then(|| (edge.nodes, add(scale(add(a, b), 0.5), bend)))
        });
        (edge_points.collect(), straightened)
    }
}

/// Returns the bend of an edge: the displacement (mm) from the midpoint of the straight edge to the surface on which
/// the edge should lie, limited by [`FARTHEST`].
fn bend(at: &Relocation, edge: &Edge) -> Point {
    let [a, b] = edge.nodes.map(|node| at.nodes[node as usize]);
    let middle = scale(add(a, b), 0.5);
    let most = FARTHEST * norm(sub(b, a));
    let mut point = at.hold(edge.held, middle, middle);
    if !edge.labels.is_empty() {
        for _ in 0..2 {
            let pull = Pull::new(at, &edge.labels, edge.held, point);
            point = at.hold(edge.held, middle, add(point, pull.to_surface(most)));
        }
    }
    let bend = sub(point, middle);
    let length = norm(bend);
    if length > most { scale(bend, most / length) } else { bend }
}

/// Returns the mid-edge points of a tetrahedron, displaced by `bend` on curved edges.
fn middles(corners: &[Point; 4], edges: &[u32; 6], bend: impl Fn(usize) -> Point) -> [Point; 6] {
    std::array::from_fn(|k| {
        let middle = mean(EDGES[k].map(|corner| corners[corner]).into_iter());
        match edges[k] {
            STAYS => middle,
            edge => add(middle, bend(edge as usize)),
        }
    })
}
