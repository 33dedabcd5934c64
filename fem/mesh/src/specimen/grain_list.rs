//! Analytic grains in a cylinder, found by a grid of cells.

use super::{Grain, GrainField};
use crate::mesh::vector::Point;

/// Cells of the grid for each grain, about.
const CELLS: f64 = 4.0;
/// Samples along each axis of a grain's box for the volume of one that is cut by the cylinder.
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
    /// Of grains in a cylinder that stands on z = 0 with its axis on z (mm). Of grains that reach
    /// out of it, the volume inside counts, by samples.
    pub fn new(grains: Vec<Grain>, radius_mm: f64, height_mm: f64) -> GrainList {
        let volumes_mm3 =
            grains.iter().map(|grain| volume_inside(grain, radius_mm, height_mm)).collect();
        let cells = Cells::new(&grains);
        GrainList { grains, volumes_mm3, cells }
    }

    /// The grains, from number 1.
    pub fn list(&self) -> &[Grain] {
        &self.grains
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

    fn near(&self, x: [f64; 3], reach: f64, found: &mut Vec<u32>) {
        self.cells.within(x, reach, found);
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

/// A grid whose cells list the grains whose bounding boxes they touch.
#[derive(Clone, Debug)]
struct Cells {
    low: Point,
    width: f64,
    count: [usize; 3],
    /// The grains of cell c stand in `grains` from `start[c]` to `start[c + 1]`, increasing.
    start: Vec<u32>,
    grains: Vec<u32>,
}

impl Cells {
    fn new(grains: &[Grain]) -> Cells {
        let reach: Vec<f64> = grains.iter().map(Grain::bounding_radius_mm).collect();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (grain, reach) in grains.iter().zip(&reach) {
            for k in 0..3 {
                low[k] = low[k].min(grain.centre[k] - reach);
                high[k] = high[k].max(grain.centre[k] + reach);
            }
        }
        if grains.is_empty() {
            return Cells {
                low: [0.0; 3],
                width: 1.0,
                count: [0; 3],
                start: vec![0],
                grains: vec![],
            };
        }
        let extent: Point = std::array::from_fn(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let volume: f64 = extent.iter().product();
        // never finer than the thinnest side would need, so that flat lists stay small
        let longest = extent.iter().copied().fold(0.0, f64::max);
        let width = (volume / (CELLS * grains.len() as f64)).cbrt().max(longest / 256.0);
        let count = extent.map(|x| ((x / width).ceil() as usize).clamp(1, 257));
        let mut cells = Cells { low, width, count, start: Vec::new(), grains: Vec::new() };
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (number, (grain, &reach)) in (1..).zip(grains.iter().zip(&reach)) {
            cells.visit(grain.centre, reach, |cell| pairs.push((cell as u32, number)));
        }
        pairs.sort_unstable();
        let total = count.iter().product::<usize>();
        cells.start = vec![0; total + 1];
        for &(cell, _) in &pairs {
            cells.start[cell as usize + 1] += 1;
        }
        for cell in 0..total {
            cells.start[cell + 1] += cells.start[cell];
        }
        cells.grains = pairs.into_iter().map(|(_, grain)| grain).collect();
        cells
    }

    /// Calls `each` with the cells that the cube around a ball touches.
    fn visit(&self, centre: Point, radius: f64, mut each: impl FnMut(usize)) {
        if self.count[0] == 0 {
            return;
        }
        let cell = |x: f64, k: usize| {
            let at = ((x - self.low[k]) / self.width).floor();
            at.clamp(0.0, (self.count[k] - 1) as f64) as usize
        };
        let low: [usize; 3] = std::array::from_fn(|k| cell(centre[k] - radius, k));
        let high: [usize; 3] = std::array::from_fn(|k| cell(centre[k] + radius, k));
        for c in low[2]..=high[2] {
            for b in low[1]..=high[1] {
                for a in low[0]..=high[0] {
                    each(a + self.count[0] * (b + self.count[1] * c));
                }
            }
        }
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.grains[self.start[cell] as usize..self.start[cell + 1] as usize]
    }

    /// The grains of the cell that a point lies in (of the nearest one for points outside).
    fn at(&self, x: Point) -> &[u32] {
        let mut found: &[u32] = &[];
        self.visit(x, 0.0, |cell| found = self.of(cell));
        found
    }

    fn within(&self, x: Point, reach: f64, found: &mut Vec<u32>) {
        let first = found.len();
        self.visit(x, reach, |cell| found.extend_from_slice(self.of(cell)));
        found[first..].sort_unstable();
        let mut kept = first;
        for k in first..found.len() {
            if kept == first || found[kept - 1] != found[k] {
                found[kept] = found[k];
                kept += 1;
            }
        }
        found.truncate(kept);
    }
}
