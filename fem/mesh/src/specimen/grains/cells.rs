//! Spatial index of grains: a grid of cells.

use crate::mesh::groups::Groups;
use crate::mesh::vector::Point;

/// Approximate number of cells of the grid per grain.
const CELLS: f64 = 4.0;

/// A grid of cells; each cell lists the grains whose bounding boxes intersect it.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// Minimum coordinates of the grid (mm).
    low: Point,
    /// Edge length of a cell (mm).
    width: f64,
    /// Number of cells along each axis.
    count: [usize; 3],
    /// Grains of each cell, in increasing order.
    grains: Groups,
}

impl Cells {
    /// Builds the grid from the bounding box of each grain (minimum and maximum coordinates, mm); grains are numbered
    /// from 1.
    pub(crate) fn new(boxes: &[[Point; 2]]) -> Cells {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for bounds in boxes {
            for k in 0..3 {
                low[k] = low[k].min(bounds[0][k]);
                high[k] = high[k].max(bounds[1][k]);
            }
        }
        if boxes.is_empty() {
            return Cells { low: [0.0; 3], width: 1.0, count: [0; 3], grains: Groups::default() };
        }
        let extent: Point = std::array::from_fn(|k| (high[k] - low[k]).max(f64::MIN_POSITIVE));
        let volume: f64 = extent.iter().product();
        // limit the number of cells along the longest side to about 256, so that grains in a flat arrangement do not
        // need too many cells
        let longest = extent.iter().copied().fold(0.0, f64::max);
        let width = (volume / (CELLS * boxes.len() as f64)).cbrt().max(longest / 256.0);
        let count = extent.map(|x| ((x / width).ceil() as usize).clamp(1, 257));
        let mut cells = Cells { low, width, count, grains: Groups::default() };
        let mut pairs: Vec<(u32, u32)> = Vec::new();
        for (number, &bounds) in (1..).zip(boxes) {
            cells.visit(bounds, |cell| pairs.push((cell as u32, number)));
        }
        cells.grains = Groups::new(count.iter().product(), pairs.iter().copied());
        cells
    }

    /// Calls `each` with the index of every cell that a box intersects.
    fn visit(&self, [from, to]: [Point; 2], mut each: impl FnMut(usize)) {
        if self.count[0] == 0 {
            return;
        }
        let cell = |x: f64, k: usize| {
            let at = ((x - self.low[k]) / self.width).floor();
            at.clamp(0.0, (self.count[k] - 1) as f64) as usize
        };
        let low: [usize; 3] = std::array::from_fn(|k| cell(from[k], k));
        let high: [usize; 3] = std::array::from_fn(|k| cell(to[k], k));
        for c in low[2]..=high[2] {
            for b in low[1]..=high[1] {
                for a in low[0]..=high[0] {
                    each(a + self.count[0] * (b + self.count[1] * c));
                }
            }
        }
    }

    /// Returns the grains listed by the cell that contains a point, or by the nearest cell if the point is outside
    /// the grid.
    pub(crate) fn at(&self, x: Point) -> &[u32] {
        let mut grains: &[u32] = &[];
        self.visit([x, x], |cell| grains = self.grains.of(cell));
        grains
    }

    /// Appends, in increasing order, the grains listed by the cells that intersect a cube of half-width
    /// `reach` (mm) around a point.
    pub(crate) fn within(&self, x: Point, reach: f64, grains: &mut Vec<u32>) {
        self.in_box([x.map(|x| x - reach), x.map(|x| x + reach)], grains);
    }

    /// Appends, in increasing order, the grains listed by the cells that a box intersects.
    pub(crate) fn in_box(&self, bounds: [Point; 2], grains: &mut Vec<u32>) {
        let first = grains.len();
        self.visit(bounds, |cell| grains.extend_from_slice(self.grains.of(cell)));
        grains[first..].sort_unstable();
        let mut end = first;
        for k in first..grains.len() {
            if end == first || grains[end - 1] != grains[k] {
                grains[end] = grains[k];
                end += 1;
            }
        }
        grains.truncate(end);
    }
}
