//! Labels of the tetrahedra of a conforming mesh.

use rayon::prelude::*;

use super::Conforming;
use super::contact::{Gaps, part_from_ends};
use crate::mesh::TetMesh;
use crate::specimen::meshing::adjacency::Adjacency;
use crate::specimen::meshing::samples::{Sampled, majority};

/// Connected components of equal labels with fewer than this number of tetrahedra are relabelled.
const SMALLEST_COMPONENT: usize = 3;

/// Returns the label of each tetrahedron: the number of the grain that contains most of its sample points, or 0 for
/// matrix. Small components are relabelled. Grains that share nodes in the mesh although they do not touch in the
/// specimen are separated by matrix. Grains that do not touch an end of the cylinder are separated from this end in the
/// same way.
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
