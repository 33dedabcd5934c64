//! Which grains that meet on the mesh touch, and which only come near.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Conforming;
use crate::mesh::TetMesh;
use crate::mesh::vector::Point;
use crate::specimen::GrainField;
use crate::specimen::adjacency::Adjacency;

/// Halvings of the step in the search for the narrowest place.
const HALVINGS: usize = 12;

/// For pairs of grains that share nodes, whether matrix parts them in truth.
///
/// A film thinner than the mesh would be lost and weld the grains together; so they are parted by
/// tetrahedra of matrix wherever their surfaces are farther apart than what the field resolves.
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
        // the narrowest place of each pair first
        pairs.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        pairs.dedup_by_key(|&mut (pair, ..)| pair);
        let touching = how.field.resolution_mm().max(1e-6 * how.spacing_mm);
        let decide = |&(pair, _, node): &([u32; 2], f64, usize)| {
            let least =
                narrowest(how.field, pair, mesh.nodes[node], 0.5 * how.spacing_mm, touching);
            (pair, least > touching)
        };
        Gaps(pairs.par_iter().map(decide).collect::<Vec<_>>().into_iter().collect())
    }

    /// Whether matrix parts two grains; grains that share no node count as parted.
    pub(super) fn is_open(&self, a: u32, b: u32) -> bool {
        self.0.get(&[a.min(b), a.max(b)]).copied().unwrap_or(true)
    }
}

/// The distances to both surfaces together: the length of a way from one to the other.
fn gap(field: &dyn GrainField, [a, b]: [u32; 2], x: Point) -> f64 {
    field.distance(a, x) + field.distance(b, x)
}

/// The least gap near a point, by a search along the axes; stops below `enough`.
fn narrowest(field: &dyn GrainField, pair: [u32; 2], x: Point, step: f64, enough: f64) -> f64 {
    let (mut x, mut least, mut step) = (x, gap(field, pair, x), step);
    for _ in 0..HALVINGS {
        // a few steps of this length, as long as they help
        for _ in 0..4 {
            let mut best = (least, x);
            for axis in 0..3 {
                for sign in [-1.0, 1.0] {
                    let mut tried = x;
                    tried[axis] += sign * step;
                    let gap = gap(field, pair, tried);
                    if gap < best.0 {
                        best = (gap, tried);
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
