//! Separation of grains: grains are shrunk about their centroids until each pair has a minimum distance.

use rayon::prelude::*;

use super::gap::{ScaledSurface, Search, box_gap, gap_below};
use super::triangle_tree::TriangleTree;
use crate::mesh::Surface;
use crate::mesh::vector::Point;
use crate::specimen::grains::Cells;

/// Smallest scaling factor. If two grains are still too close with this factor, one grain probably lies inside the
/// other grain.
const LEAST_FACTOR: f64 = 0.2;
/// Number of bisection steps in the search for a scaling factor.
const HALVINGS: usize = 30;
/// Two grains that are too close are shrunk by at least this relative amount per round. Convex grains need two rounds;
/// with this minimum, the iteration also ends for grains that are not convex.
const LEAST_STEP: f64 = 1e-6;

/// Surfaces that were scaled until each pair has the required distance.
#[derive(Clone, Debug)]
pub struct Separated {
    /// The scaled surfaces, in the order in which they were given.
    pub surfaces: Vec<Surface>,
    /// Scaling factor of each surface; 1 if the surface was far enough from all other surfaces.
    pub factors: Vec<f64>,
}

/// Error of two surfaces that cannot be separated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "shrinking to a fifth of their size does not bring grains {first} and {second} {least_mm} mm apart: one grain lies \
     inside the other grain, or the distance is too large; remove one grain or reduce the distance"
)]
pub struct SeparateError {
    /// Number of one surface, from 1.
    pub first: usize,
    /// Number of the other surface, from 1.
    pub second: usize,
    /// The required minimum distance (mm).
    pub least_mm: f64,
}

/// Scales closed surfaces about their centroids until each pair is at least `least_mm` apart. A surface that is far
/// enough from all other surfaces is not changed; both surfaces of a pair that is too close are scaled by the same
/// factor.
///
/// # Errors
/// [`SeparateError`] for the first pair that would have to shrink to less than a fifth of its size.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Surface, separated, stl};
///
/// let mesh = CylinderLattice { radius_mm: 1.0, height_mm: 2.0, spacing_mm: 0.5 }.build()?;
/// let one = Surface::new(&stl::specimen(&mesh));
/// let mut other = one.clone();
/// other.points.iter_mut().for_each(|point| point[2] += 2.0);
/// let apart = separated(vec![one, other], 0.1)?;
/// // with a factor s, each of the two touching ends moves by (1 − s) · 1 mm
/// assert!((apart.factors[0] - 0.95).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn separated(surfaces: Vec<Surface>, least_mm: f64) -> Result<Separated, SeparateError> {
    let trees: Vec<TriangleTree> = surfaces.par_iter().map(TriangleTree::new).collect();
    let centres: Vec<Point> = surfaces.par_iter().map(Surface::centroid).collect();
    let mut factors = vec![1.0; surfaces.len()];
    let scaled = |grain: usize, factor: f64| ScaledSurface {
        tree: &trees[grain],
        centre: centres[grain],
        factor,
    };
    let pairs = near_pairs(&trees, least_mm);
    loop {
        let factor_of = |&(a, b): &(usize, usize)| -> Result<Option<f64>, SeparateError> {
            let is_apart = |t: f64| {
                let (one, other) = (scaled(a, t * factors[a]), scaled(b, t * factors[b]));
                gap_below(&one, &other, least_mm, Search::Any).is_none()
            };
            if is_apart(1.0) {
                return Ok(None);
            }
            let (mut low, mut high) = (LEAST_FACTOR / factors[a].max(factors[b]), 1.0);
            if low >= high || !is_apart(low) {
                return Err(SeparateError { first: a + 1, second: b + 1, least_mm });
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if is_apart(middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            Ok(Some(low.min(1.0 - LEAST_STEP)))
        };
        let results: Vec<Result<Option<f64>, SeparateError>> =
            pairs.par_iter().map(factor_of).collect();
        let new_factors = results.into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut next = vec![1.0_f64; factors.len()];
        for (&(a, b), factor) in pairs.iter().zip(&new_factors) {
            for grain in [a, b] {
                next[grain] = next[grain].min(factor.unwrap_or(1.0));
            }
        }
        if new_factors.iter().all(Option::is_none) {
            break;
        }
        factors.iter_mut().zip(&next).for_each(|(factor, next)| *factor *= next);
    }
    let scale = |(surface, &factor): (&Surface, &f64)| match factor < 1.0 {
        true => surface.scaled(factor),
        false => surface.clone(),
    };
    let surfaces = surfaces.iter().zip(&factors).map(scale).collect();
    Ok(Separated { surfaces, factors })
}

/// Returns the smallest distance between any two closed surfaces (mm; 0 if two surfaces intersect) and the numbers of
/// the two surfaces with this distance, from 1. Returns `None` for fewer than two surfaces.
pub fn least_gap_mm(surfaces: &[Surface]) -> Option<(f64, [usize; 2])> {
    let trees: Vec<TriangleTree> = surfaces.par_iter().map(TriangleTree::new).collect();
    if trees.len() < 2 {
        return None;
    }
    let size = |tree: &TriangleTree| {
        let [low, high] = tree.bounds();
        (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max)
    };
    let mut reach = 0.1 * trees.iter().map(size).sum::<f64>() / trees.len() as f64;
    loop {
        let as_given =
            |grain: usize| ScaledSurface { tree: &trees[grain], centre: [0.0; 3], factor: 1.0 };
        let gap = |&(a, b): &(usize, usize)| {
            let gap = gap_below(&as_given(a), &as_given(b), reach, Search::Least)?;
            Some((gap, [a + 1, b + 1]))
        };
        let gaps: Vec<(f64, [usize; 2])> =
            near_pairs(&trees, reach).par_iter().filter_map(gap).collect();
        let least = gaps.into_iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if least.is_some() || !reach.is_finite() || reach <= 0.0 {
            return least;
        }
        reach *= 8.0;
    }
}

/// Returns the pairs of surfaces whose bounding boxes are at most `reach` (mm) apart, as pairs of increasing indices.
pub(super) fn near_pairs(trees: &[TriangleTree], reach: f64) -> Vec<(usize, usize)> {
    let boxes: Vec<[Point; 2]> = trees.iter().map(TriangleTree::bounds).collect();
    let cells = Cells::new(&boxes);
    let of_grain = |a: usize| {
        let [low, high] = boxes[a];
        let mut near = Vec::new();
        cells.in_box([low.map(|x| x - reach), high.map(|x| x + reach)], &mut near);
        let others = near.into_iter().map(|number| number as usize - 1);
        let is_near = |&b: &usize| b > a && box_gap(boxes[a], boxes[b]) <= reach;
        others.filter(is_near).map(|b| (a, b)).collect::<Vec<_>>()
    };
    (0..boxes.len()).into_par_iter().flat_map_iter(of_grain).collect()
}
