//! Labels of the tetrahedra of a conforming mesh.

use rayon::prelude::*;

use super::Conforming;
use super::contact::{Gaps, part_from_ends};
use crate::mesh::TetMesh;
use crate::specimen::meshing::adjacency::Adjacency;
use crate::specimen::meshing::samples::{Sampled, majority};

/// A connected component of equal labels with fewer tetrahedra is relabelled.
const SMALLEST_COMPONENT: usize = 3;

/// Returns the label of each tetrahedron: the grain that contains most of its samples, or 0. Small components are
/// relabelled. Grains that do not really touch each other or an end are separated by matrix.
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
    around.separate_grains(&mut labels, |a, b| gaps.is_separated(a, b));
    part_from_ends(how, mesh, around, &mut labels);
    around.drop_small_components(&mut labels, SMALLEST_COMPONENT);
    around.drop_spikes(&mut labels);
    around.drop_small_components(&mut labels, SMALLEST_COMPONENT);
    labels
}
