//! Grains given as closed surfaces, for example from STL files of other programs.

use rayon::prelude::*;

use super::triangle_tree::TriangleTree;
use crate::mesh::Surface;
use crate::mesh::vector::Point;
use crate::specimen::grains::{Cells, GrainField};

/// The volume inside the cylinder of a grain that extends beyond the cylinder is estimated with this number of sample
/// points along each axis of the grain's bounding box.
const CUT_SAMPLES: usize = 48;

/// Closed surfaces in a cylinder: a [`GrainField`] with exact distances to their triangles.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, GrainField, Surface, SurfaceGrains, stl};
///
/// let inner = CylinderLattice { radius_mm: 1.0, height_mm: 2.0, spacing_mm: 0.5 }.build()?;
/// let grains = SurfaceGrains::new(vec![Surface::new(&stl::specimen(&inner))], 2.5, 4.4)?;
/// assert_eq!(grains.grain_at([0.1, 0.0, 1.0]), 1);
/// assert_eq!(grains.grain_at([0.1, 0.0, 2.1]), 0);
/// assert!((grains.distance(1, [0.0, 0.0, 2.5]) - 0.5).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SurfaceGrains {
    grains: Vec<TriangleTree>,
    volumes_mm3: Vec<f64>,
    cells: Cells,
}

/// Error of a surface that is not a valid grain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A surface has open edges.
    #[error(
        "grain {grain}: the surface of {triangles} triangles has {open} open edges; close its holes and export \
         the surface again"
    )]
    Open {
        /// Number of the grain, from 1.
        grain: usize,
        /// Number of triangles of the surface.
        triangles: usize,
        /// Number of open edges of the surface.
        open: usize,
    },
    /// A surface encloses no volume.
    #[error(
        "grain {grain}: the surface of {triangles} triangles encloses no volume; remove the surface"
    )]
    Flat {
        /// Number of the grain, from 1.
        grain: usize,
        /// Number of triangles of the surface.
        triangles: usize,
    },
}

impl SurfaceGrains {
    /// Creates grains from their surfaces, in a cylinder with its bottom at z = 0 and its axis on z (mm). Surfaces with
    /// normals pointing inwards are reversed. For a grain that extends beyond the cylinder, only the volume inside the
    /// cylinder counts. This volume is estimated by sample points.
    ///
    /// # Errors
    /// [`SurfaceError`] for the first surface that is not closed or has no volume.
    pub fn new(
        surfaces: Vec<Surface>,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<SurfaceGrains, SurfaceError> {
        let grain = |(number, surface): (usize, Surface)| {
            let (triangles, open_count) = (surface.triangles.len(), surface.open_edges());
            if open_count > 0 {
                return Err(SurfaceError::Open { grain: number + 1, triangles, open: open_count });
            }
            let surface = surface.outward();
            let whole = surface.volume();
            if whole.is_nan() || whole <= 0.0 {
                return Err(SurfaceError::Flat { grain: number + 1, triangles });
            }
            let tree = TriangleTree::new(&surface);
            let is_inside = |p: &Point| is_inside(*p, radius_mm, height_mm);
            let volume = match surface.points.iter().all(is_inside) {
                true => whole,
                false => whole * share_inside(&tree, radius_mm, height_mm),
            };
            Ok((tree, volume))
        };
        let surfaces: Vec<(usize, Surface)> = surfaces.into_iter().enumerate().collect();
        let grains: Result<Vec<_>, _> = surfaces.into_par_iter().map(grain).collect();
        let (grains, volumes_mm3): (Vec<TriangleTree>, _) = grains?.into_iter().unzip();
        let cells = Cells::new(&grains.iter().map(TriangleTree::bounds).collect::<Vec<_>>());
        Ok(SurfaceGrains { grains, volumes_mm3, cells })
    }

    fn tree(&self, grain: u32) -> &TriangleTree {
        &self.grains[grain as usize - 1]
    }
}

fn is_inside([x, y, z]: Point, radius: f64, height: f64) -> bool {
    x.hypot(y) <= radius && (0.0..=height).contains(&z)
}

/// Returns the fraction of a grain's volume inside the cylinder, estimated by samples in the grain's bounding box.
fn share_inside(tree: &TriangleTree, radius: f64, height: f64) -> f64 {
    let [low, high] = tree.bounds();
    let n = CUT_SAMPLES;
    let (mut inside, mut all) = (0_usize, 0_usize);
    for sample in (0..n * n * n).map(|c| [c % n, c / n % n, c / n / n]) {
        let point = std::array::from_fn(|k| {
            low[k] + (high[k] - low[k]) * (sample[k] as f64 + 0.5) / n as f64
        });
        if tree.below(point, 0.0).is_some() {
            all += 1;
            inside += usize::from(is_inside(point, radius, height));
        }
    }
    if all == 0 { 0.0 } else { inside as f64 / all as f64 }
}

/// Returns whether a point lies in a grain's bounding box enlarged by `reach`.
fn is_near([low, high]: [Point; 2], x: Point, reach: f64) -> bool {
    (0..3).all(|k| x[k] > low[k] - reach && x[k] < high[k] + reach)
}

impl GrainField for SurfaceGrains {
    fn grains(&self) -> usize {
        self.grains.len()
    }

    fn grain_at(&self, x: [f64; 3]) -> u32 {
        let mut near = Vec::new();
        self.near(x, 0.0, &mut near);
        let distance = |grain: u32| Some((self.distance_below(grain, x, 0.0)?, grain));
        let here = near.into_iter().filter_map(distance);
        here.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, grain)| grain)
    }

    fn distance(&self, grain: u32, x: [f64; 3]) -> f64 {
        self.distance_and_gradient(grain, x, 0.0).0
    }

    fn volume_mm3(&self, grain: u32) -> f64 {
        self.volumes_mm3[grain as usize - 1]
    }

    fn near(&self, x: [f64; 3], reach: f64, grains: &mut Vec<u32>) {
        let first = grains.len();
        self.cells.within(x, reach, grains);
        let near = grains.split_off(first);
        grains.extend(near.into_iter().filter(|&n| is_near(self.tree(n).bounds(), x, reach)));
    }

    fn resolution_mm(&self) -> f64 {
        1e-9
    }

    fn distance_below(&self, grain: u32, x: [f64; 3], limit: f64) -> Option<f64> {
        let tree = self.tree(grain);
        if !is_near(tree.bounds(), x, limit.max(0.0)) {
            return None;
        }
        tree.below(x, limit).map(|(distance, _)| distance)
    }

    fn distance_and_gradient(&self, grain: u32, x: [f64; 3], _step: f64) -> (f64, [f64; 3]) {
        self.tree(grain).below(x, f64::INFINITY).unwrap_or((f64::INFINITY, [0.0; 3]))
    }
}
