//! Voids of an image of grey values as regions of their own.

use crate::volume::components::Components;

/// Labels the face-connected parts of a set of void voxels that have at least `least` voxels. The labels begin with
/// `first` and follow the order of the first voxels of the parts. Returns the number of voxels of each part.
pub(super) fn label_voids(
    shape: [usize; 3],
    is_void: &[u8],
    labels: &mut [u32],
    first: u32,
    least: usize,
) -> Vec<usize> {
    let [nx, ny, nz] = shape;
    let mut parts = Components::of(shape, is_void, |voxel| (voxel != 0).then_some(()));
    let roots: Vec<usize> =
        (0..parts.runs.len()).map(|run| parts.sets.root(run as u32) as usize).collect();
    let mut sizes = vec![0; roots.len()];
    for (run, &root) in parts.runs.iter().zip(&roots) {
        sizes[root] += (run.to - run.from) as usize;
    }
    let mut label_of_root = vec![0; roots.len()];
    let mut labelled_sizes = Vec::new();
    // the root of a part is its first run
    for root in (0..roots.len()).filter(|&run| roots[run] == run && sizes[run] >= least) {
        label_of_root[root] = first + labelled_sizes.len() as u32;
        labelled_sizes.push(sizes[root]);
    }
    for row in 0..ny * nz {
        for run in parts.of_row(row).filter(|&run| label_of_root[roots[run]] != 0) {
            let [from, to] = [parts.runs[run].from, parts.runs[run].to].map(|x| x as usize);
            labels[nx * row..][from..to].fill(label_of_root[roots[run]]);
        }
    }
    labelled_sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_enough_voxels_are_labelled_in_their_order() {
        // two slices of 4 × 2 voxels: a part of one voxel, a part of four voxels, and a part of two voxels
        let is_void = [1, 0, 1, 1, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0];
        let mut labels = [0, 7, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        let sizes = label_voids([4, 2, 2], &is_void, &mut labels, 8, 2);
        assert_eq!(sizes, [4, 2]);
        assert_eq!(labels, [0, 7, 8, 8, 7, 0, 0, 0, 0, 0, 8, 8, 9, 9, 0, 0]);
    }
}
