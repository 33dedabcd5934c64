//! Overlapping volumes of grains.

use rayon::prelude::*;

use super::gap::{ScaledSurface, Search, gap_below};
use super::separate::near_pairs;
use super::triangle_tree::TriangleTree;
use crate::mesh::Surface;
use crate::mesh::vector::Point;

/// The overlap of two grains is estimated in the intersection of their bounding boxes, with this number of sample
/// points along each axis.
const SAMPLES: usize = 10;
/// Two surfaces intersect if their distance is below this value times the size of the first grain.
const TOUCHING: f64 = 1e-9;

/// Two grains that overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap {
    /// Indices of the two grains.
    pub(super) grains: [usize; 2],
    /// Volume that both grains have in common (mm³), estimated by sample points.
    pub(super) volume_mm3: f64,
}

/// Returns all pairs of closed surfaces that overlap.
pub(super) fn overlaps(surfaces: &[Surface]) -> Vec<Overlap> {
    let trees: Vec<TriangleTree> = surfaces.par_iter().map(TriangleTree::new).collect();
    let overlap = |&(a, b): &(usize, usize)| {
        let as_given =
            |grain: usize| ScaledSurface { tree: &trees[grain], centre: [0.0; 3], factor: 1.0 };
        let [low, high] = trees[a].bounds();
        let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        gap_below(&as_given(a), &as_given(b), TOUCHING * size, Search::Any)?;
        let volume_mm3 = shared_volume(&trees[a], &trees[b]);
        (volume_mm3 > 0.0).then_some(Overlap { grains: [a, b], volume_mm3 })
    };
    near_pairs(&trees, 0.0).par_iter().filter_map(overlap).collect()
}

/// Returns the volume that lies inside both surfaces, estimated by sample points in the intersection of their bounding
/// boxes.
fn shared_volume(one: &TriangleTree, other: &TriangleTree) -> f64 {
    let ([low, high], [other_low, other_high]) = (one.bounds(), other.bounds());
    let from: Point = std::array::from_fn(|k| low[k].max(other_low[k]));
    let size: Point = std::array::from_fn(|k| (high[k].min(other_high[k]) - from[k]).max(0.0));
    let n = SAMPLES;
    let is_shared = |sample: &usize| {
        let at = [sample % n, sample / n % n, sample / n / n];
        let x = std::array::from_fn(|k| from[k] + size[k] * (at[k] as f64 + 0.5) / n as f64);
        one.below(x, 0.0).is_some() && other.below(x, 0.0).is_some()
    };
    let shared = (0..n * n * n).filter(is_shared).count();
    size.iter().product::<f64>() * shared as f64 / (n * n * n) as f64
}
