//! Spheres and polyhedra in a cylinder. A grid of cells finds the grains near a point.

use super::cells::Cells;
use super::field::GrainField;
use super::grain::Grain;
use crate::mesh::Surface;
use crate::mesh::surface::isosurface;
use crate::mesh::vector::Point;

/// Number of cells across a grain in the grid from which the surface of the grain is extracted.
const SURFACE_CELLS: usize = 32;
/// The volume inside the cylinder of a grain that extends beyond the cylinder is estimated with this number of sample
/// points along each axis of the grain's bounding box.
const CUT_SAMPLES: usize = 64;

/// A list of spheres and polyhedra in a cylinder: a [`GrainField`] with exact distances.
///
/// # Example
/// ```
/// use fem_mesh::{Grain, GrainField, GrainList};
///
/// let grains = vec![Grain::sphere([0.0, 0.0, 2.0], 1.0), Grain::sphere([0.0, 1.5, 3.5], 0.4)];
/// let grains = GrainList::new(grains, 2.5, 4.4);
/// assert_eq!(grains.grain_at([0.0, 1.5, 3.4]), 2);
/// assert_eq!(grains.distance(1, [0.0, 0.0, 3.5]), 0.5);
/// ```
#[derive(Clone, Debug)]
pub struct GrainList {
    grains: Vec<Grain>,
    volumes_mm3: Vec<f64>,
    cells: Cells,
}

impl GrainList {
    /// Creates a list of grains in a cylinder with its bottom at z = 0 and its axis on z (mm). For a grain that extends
    /// beyond the cylinder, only the volume inside the cylinder counts. This volume is estimated by sample points.
    pub fn new(grains: Vec<Grain>, radius_mm: f64, height_mm: f64) -> GrainList {
        let volumes_mm3 =
            grains.iter().map(|grain| volume_inside(grain, radius_mm, height_mm)).collect();
        let cells = Cells::new(&grains.iter().map(bounds).collect::<Vec<_>>());
        GrainList { grains, volumes_mm3, cells }
    }

    /// Returns the grains; the first grain has number 1.
    pub fn list(&self) -> &[Grain] {
        &self.grains
    }

    /// Returns the closed surface of a grain (mm), extracted on a grid of 32 cells across the grain and scaled to the
    /// grain's exact volume; sharp edges are chamfered by about one cell. The surface encloses the whole grain,
    /// including the part outside the cylinder.
    pub fn surface(&self, number: u32) -> Surface {
        let grain = self.grain(number);
        let reach = grain.bounding_radius_mm();
        let cell = 2.0 * reach / SURFACE_CELLS as f64;
        let at = |k: usize, x: f64| grain.centre[k] - reach + (x - 1.0) * cell;
        let mut surface = isosurface([SURFACE_CELLS + 3; 3], &|node| {
            grain.signed_distance_mm(std::array::from_fn(|k| at(k, node[k] as f64)))
        });
        for point in &mut surface.points {
            *point = std::array::from_fn(|k| at(k, point[k]));
        }
        surface.scaled((grain.volume_mm3() / surface.volume()).cbrt())
    }

    fn grain(&self, number: u32) -> &Grain {
        &self.grains[number as usize - 1]
    }
}

impl GrainField for GrainList {
    fn grains(&self) -> usize {
        self.grains.len()
    }

    fn grain_at(&self, x: [f64; 3]) -> u32 {
        let distance = |&grain: &u32| Some((self.distance_below(grain, x, 0.0)?, grain));
        let here = self.cells.at(x).iter().filter_map(distance);
        here.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, grain)| grain)
    }

    fn distance(&self, grain: u32, x: [f64; 3]) -> f64 {
        self.grain(grain).signed_distance_mm(x)
    }

    fn volume_mm3(&self, grain: u32) -> f64 {
        self.volumes_mm3[grain as usize - 1]
    }

    fn near(&self, x: [f64; 3], reach: f64, grains: &mut Vec<u32>) {
        self.cells.within(x, reach, grains);
    }

    fn reaches(&self, grain: u32, x: [f64; 3], reach: f64) -> bool {
        // the factor allows for the rounding errors of distances
        self.distance_below(grain, x, (1.0 + 1e-9) * reach).is_some()
    }

    fn resolution_mm(&self) -> f64 {
        1e-9
    }

    fn distance_below(&self, grain: u32, x: [f64; 3], limit: f64) -> Option<f64> {
        let nearest = self.grain(grain).nearest_below_mm(x, limit);
        nearest.map(|(distance, _)| distance).filter(|&distance| distance < limit)
    }

    fn distance_and_gradient(&self, grain: u32, x: [f64; 3], _step: f64) -> (f64, [f64; 3]) {
        let nearest = self.grain(grain).nearest_below_mm(x, f64::INFINITY);
        nearest.unwrap_or((f64::INFINITY, [0.0; 3]))
    }
}

/// Returns the bounding cube of the grain's bounding sphere.
fn bounds(grain: &Grain) -> [Point; 2] {
    let reach = grain.bounding_radius_mm();
    [grain.centre.map(|x| x - reach), grain.centre.map(|x| x + reach)]
}

/// Returns the volume of a grain inside the cylinder (mm³).
fn volume_inside(grain: &Grain, radius: f64, height: f64) -> f64 {
    if radius.is_infinite() || grain.is_inside(radius, height) {
        return grain.volume_mm3();
    }
    let reach = grain.bounding_radius_mm();
    let [x, y, z] = grain.centre;
    let is_inside = |[x, y, z]: Point| x.hypot(y) < radius && (0.0..height).contains(&z);
    let n = CUT_SAMPLES;
    let (mut inside, mut all) = (0_usize, 0_usize);
    for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
        let at = |i: usize| reach * ((2 * i + 1) as f64 / n as f64 - 1.0);
        let point = [x + at(i), y + at(j), z + at(k)];
        if grain.nearest_below_mm(point, 0.0).is_some_and(|(distance, _)| distance < 0.0) {
            all += 1;
            inside += usize::from(is_inside(point));
        }
    }
    if all == 0 { 0.0 } else { grain.volume_mm3() * inside as f64 / all as f64 }
}
