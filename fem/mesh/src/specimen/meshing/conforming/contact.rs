//! Contacts between grains, and between grains and the ends of the cylinder: decides whether grains that share nodes of
//! the mesh, or have nodes on an end, touch in the specimen or are separated by a thin film of matrix.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Conforming;
use crate::mesh::TetMesh;
use crate::mesh::vector::Point;
use crate::specimen::grains::GrainField;
use crate::specimen::meshing::adjacency::Adjacency;

/// Number of times that the step length is halved in the search for the narrowest point of a gap.
const HALVINGS: usize = 12;

/// Gaps between grains: for each pair of grains that share nodes, whether matrix separates the two grains in reality.
///
/// A film of matrix that is thinner than an element would disappear in the mesh, and the grains would be rigidly
/// joined. Grains whose surfaces are farther apart than the resolution of the field are therefore separated by
/// tetrahedra of matrix.
pub(super) struct Gaps(BTreeMap<[u32; 2], bool>);

impl Gaps {
    pub(super) fn new(
        how: &Conforming,
        mesh: &TetMesh,
        around: &Adjacency,
        labels: &[u32],
    ) -> Gaps {
        let of_node = |node: usize| {
            let mut claims = around.claims(labels, node);
            claims.sort_unstable();
            let mut pairs = Vec::new();
            for (k, &(b, _)) in claims.iter().enumerate() {
                for &(a, _) in &claims[..k] {
                    let gap = gap(how.field, [a, b], mesh.nodes[node]);
                    pairs.push(([a, b], gap, node));
                }
            }
            pairs
        };
        let nodes = 0..mesh.nodes.len();
        let mut pairs: Vec<_> = nodes.into_par_iter().flat_map_iter(of_node).collect();
        // for each pair of grains, the node with the smallest gap comes first, and only this node is used
        pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        pairs.dedup_by_key(|&mut (pair, ..)| pair);
        let touching = touching_mm(how);
        let decide = |&(pair, _, node): &([u32; 2], f64, usize)| {
            let both = |x: Point| gap(how.field, pair, x);
            let least = narrowest(both, |x| x, mesh.nodes[node], 0.5 * how.spacing_mm, touching);
            (pair, least > touching)
        };
        Gaps(pairs.par_iter().map(decide).collect::<Vec<_>>().into_iter().collect())
    }

    /// Returns whether matrix separates two grains; grains that share no node count as separated.
    pub(super) fn is_separated(&self, a: u32, b: u32) -> bool {
        self.0.get(&[a.min(b), a.max(b)]).copied().unwrap_or(true)
    }
}

/// Relabels tetrahedra as matrix where a grain has nodes on an end of the cylinder although a film of matrix separates
/// the grain from this end in the specimen. Without the film, a platen would support the grain directly. Tetrahedra at
/// the wall are not relabelled: the wall is not loaded, so that a grain that reaches the wall carries no additional
/// load.
pub(super) fn part_from_ends(
    how: &Conforming,
    mesh: &TetMesh,
    around: &Adjacency,
    labels: &mut [u32],
) {
    let touching = touching_mm(how);
    for (_, triangles) in mesh.surfaces.iter().filter(|(name, _)| *name != "side") {
        let mut nodes = triangles.as_flattened().to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let mut reached: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &node in &nodes {
            for (grain, _) in around.claims(labels, node as usize) {
                reached.entry(grain).or_default().push(node);
            }
        }
        for (grain, nodes) in reached {
            let distance = |x: Point| how.field.distance(grain, x);
            let positions = nodes.iter().map(|&node| mesh.nodes[node as usize]);
            let nearest = positions.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let Some(x) = nearest else { continue };
            let on_end = |[a, b, _]: Point| [a, b, x[2]];
            if narrowest(distance, on_end, x, 0.5 * how.spacing_mm, touching) <= touching {
                continue;
            }
            for &tet in nodes.iter().flat_map(|&node| around.tets_of(node as usize)) {
                let label = &mut labels[tet as usize];
                *label = if *label == grain { 0 } else { *label };
            }
        }
    }
}

/// Returns the distance (mm) up to which surfaces count as touching.
fn touching_mm(how: &Conforming) -> f64 {
    how.field.resolution_mm().max(1e-6 * how.spacing_mm)
}

/// Returns the sum of the distances of a point to two grains (mm): the length of a path from one grain to the other
/// grain via this point.
fn gap(field: &dyn GrainField, [a, b]: [u32; 2], x: Point) -> f64 {
    field.distance(a, x) + field.distance(b, x)
}

/// Searches for the minimum of `value` near `x` by steps along the axes; `hold` projects each trial point onto the set
/// of allowed points. The search stops as soon as the value is at most `enough`.
fn narrowest(
    value: impl Fn(Point) -> f64,
    hold: impl Fn(Point) -> Point,
    x: Point,
    step: f64,
    enough: f64,
) -> f64 {
    let (mut x, mut least, mut step) = (x, value(x), step);
    for _ in 0..HALVINGS {
        // take steps of this length as long as the value decreases, but at most four steps
        for _ in 0..4 {
            let mut best = (least, x);
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let mut tried = x;
                    tried[axis] += sign * step;
                    let tried = hold(tried);
                    let tried_value = value(tried);
                    if tried_value < best.0 {
                        best = (tried_value, tried);
                    }
                }
            }
            if best.0 >= least {
                break;
            }
            (least, x) = best;
            if least <= enough {
                return least;
            }
        }
        step *= 0.5;
    }
    least
}
