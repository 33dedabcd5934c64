//! Labels of the tetrahedra of a conforming mesh.

use rayon::prelude::*;

use super::Conforming;
use super::contact::{Gaps, part_from_ends};
use crate::mesh::TetMesh;
use crate::specimen::meshing::adjacency::Adjacency;
use crate::specimen::meshing::samples::{Sampled, majority};

/// Connected components with fewer tetrahedra than this are dropped.
const SMALLEST_COMPONENT: usize = 3;

/// Returns the grain that contains most samples of each tetrahedron, or 0. Small components are dropped; grains that
/// do not really touch are separated from each other and from the ends.
pub(super) fn labels(how: &Conforming, mesh: &TetMesh, around: &Adjacency) -> Vec<u32> {
    let mut labels: Vec<u32> = (0..mesh.tets.len())
        .into_par_iter()
        .map(|tet| {
            let mut sampled = Sampled::new(how.field, &mesh.corners(tet), 0.0);
            sampled.grains.retain(|&grain| how.follows[grain as usize - 1]);
            majority(&sampled.nearest(how.field, 0.0), 0.0)
        })
        .collect();
    around.drop_small_components(&mut labels, SMALLEST_COMPONENT);
    around.drop_spikes(&mut labels);
    let gaps = Gaps::new(how, mesh, around, &labels);
    around.separate_grains(&mut labels, |a, b| gaps.is_open(a, b));
    part_from_ends(how, mesh, around, &mut labels);
    around.drop_small_components(&mut labels, SMALLEST_COMPONENT);
    around.drop_spikes(&mut labels);
    around.drop_small_components(&mut labels, SMALLEST_COMPONENT);
    labels
}
