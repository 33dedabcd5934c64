//! A box divided by planes into hexahedra; each hexahedron is divided into tetrahedra.

use super::hexahedra;
use crate::mesh::TetMesh;
use crate::mesh::vector::Point;

/// Largest number of hexahedra of a block; a larger number is reported as an error.
const MAX_CELLS: f64 = 2.0e6;

/// Division of a hexahedron into tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HexSplit {
    /// Six tetrahedra around one diagonal of the hexahedron (scaled Jacobian 0.577 in a cube). All nodes are corners of
    /// hexahedra. The diagonals of all hexahedra have the same direction.
    #[default]
    Six,
    /// Twelve tetrahedra around the centre of the hexahedron (in a mesh of cubes, scaled Jacobian 0.943 inside and
    /// 0.577 at the boundary). The mesh has no preferred diagonal, so that the mesh does not influence the direction of
    /// cracks. Tetrahedra extend across the planes between hexahedra: only [`HexSplit::Six`] represents regions bounded
    /// by these planes exactly.
    Twelve,
}

/// A box divided by planes into hexahedra; each hexahedron is divided into tetrahedra.
///
/// The only region is `matrix`, and the surfaces are `left` and `right` (x), `front` and `back` (y), `bottom` and `top`
/// (z); [`TetMesh::with_regions`] and [`TetMesh::with_surfaces`] replace regions and surfaces by a function, and
/// [`TetMesh::mapped`] bends the box into another shape. The mesh can be used with linear and with quadratic elements,
/// like every [`TetMesh`].
///
/// # Example
/// A plate whose cells grow away from x = 0, with an inclusion of 2 mm edge length:
/// ```
/// use fem_mesh::Block;
///
/// let plate = Block::new([10.0, 4.0, 1.0], [20, 8, 2]).graded(0, 4.0);
/// let mesh = plate.build()?.with_regions(&["matrix", "grain"], |[x, y, _]| {
///     u16::from(x < 2.0 && (y - 2.0).abs() < 1.0)
/// });
/// mesh.validate()?;
/// assert!((mesh.volume() - 40.0).abs() < 1e-12);
/// assert_eq!(mesh.tets.len(), 6 * 20 * 8 * 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Coordinates of the planes along x, y and z in increasing order (mm). n hexahedra along an axis need n + 1
    /// planes.
    pub planes_mm: [Vec<f64>; 3],
    /// Division of the hexahedra into tetrahedra.
    pub split: HexSplit,
}

/// Error of a block that cannot be meshed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BlockError {
    /// Fewer than two planes along an axis.
    #[error("{planes} planes along {axis}; give at least two (one cell)")]
    NoCell {
        /// Name of the axis.
        axis: char,
        /// Number of planes.
        planes: usize,
    },
    /// A plane coordinate that is not finite or not above the previous coordinate.
    #[error("plane {plane} along {axis} is at {value_mm} mm; give finite, increasing coordinates")]
    NotIncreasing {
        /// Name of the axis.
        axis: char,
        /// Index of the plane.
        plane: usize,
        /// Coordinate of the plane (mm).
        value_mm: f64,
    },
    /// The block has more hexahedra than supported.
    #[error("the planes create {cells:.1e} hexahedra, more than 2e6; use fewer planes")]
    TooMany {
        /// Number of hexahedra.
        cells: f64,
    },
}

impl Block {
    /// Creates a box with one corner at the origin, divided into equal hexahedra. `size_mm` contains the lengths and
    /// `cells` the numbers of hexahedra along x, y and z.
    pub fn new(size_mm: [f64; 3], cells: [usize; 3]) -> Block {
        let planes = |k: usize| {
            let at = |plane: usize| size_mm[k] * plane as f64 / cells[k] as f64;
            if cells[k] == 0 { Vec::new() } else { (0..=cells[k]).map(at).collect() }
        };
        Block { planes_mm: [0, 1, 2].map(planes), split: HexSplit::default() }
    }

    /// Moves the inner planes along an axis (0, 1, 2 for x, y, z) so that the widths of the hexahedra form a geometric
    /// sequence. `ratio` is the width of the last hexahedron divided by the width of the first hexahedron.
    ///
    /// # Panics
    /// If `axis` is above 2.
    pub fn graded(mut self, axis: usize, ratio: f64) -> Block {
        let planes = &mut self.planes_mm[axis];
        let cells = planes.len().saturating_sub(1);
        if cells > 1 {
            let growth = ratio.powf(1.0 / (cells - 1) as f64);
            let widths: Vec<f64> = (0..cells).map(|cell| growth.powi(cell as i32)).collect();
            let (first, total) = (planes[0], widths.iter().sum::<f64>());
            let size = planes[cells] - first;
            let mut sum = 0.0;
            for (plane, width) in planes[1..cells].iter_mut().zip(widths) {
                sum += width;
                *plane = first + size * sum / total;
            }
        }
        self
    }

    /// Sets the division of the hexahedra into tetrahedra.
    pub fn with_split(self, split: HexSplit) -> Block {
        Block { split, ..self }
    }

    /// Builds the mesh.
    ///
    /// # Errors
    /// [`BlockError`] if an axis has no cell, planes are not increasing, or there are more than 2·10⁶ hexahedra.
    pub fn build(&self) -> Result<TetMesh, BlockError> {
        for (axis, planes) in ['x', 'y', 'z'].into_iter().zip(&self.planes_mm) {
            if planes.len() < 2 {
                return Err(BlockError::NoCell { axis, planes: planes.len() });
            }
            let is_sound = |plane: usize| {
                planes[plane].is_finite() && (plane == 0 || planes[plane] > planes[plane - 1])
            };
            if let Some(plane) = (0..planes.len()).find(|&plane| !is_sound(plane)) {
                let value_mm = planes[plane];
                return Err(BlockError::NotIncreasing { axis, plane, value_mm });
            }
        }
        let [nx, ny, nz] = [0, 1, 2].map(|k| self.planes_mm[k].len());
        let cells: f64 = [nx, ny, nz].map(|n| (n - 1) as f64).iter().product();
        if cells > MAX_CELLS {
            return Err(BlockError::TooMany { cells });
        }
        let grid = |[nx, ny, nz]: [usize; 3]| {
            (0..nx * ny * nz).map(move |n| [n % nx, n / nx % ny, n / (nx * ny)])
        };
        let point = |at: [usize; 3]| -> Point { std::array::from_fn(|k| self.planes_mm[k][at[k]]) };
        let nodes: Vec<Point> = grid([nx, ny, nz]).map(point).collect();
        let hexahedron = |[i, j, k]: [usize; 3]| {
            let node = |a: usize, b: usize, c: usize| (i + a + nx * (j + b + ny * (k + c))) as u32;
            let level = |c: usize| [node(0, 0, c), node(1, 0, c), node(1, 1, c), node(0, 1, c)];
            let ([a, b, c, d], [e, f, g, h]) = (level(0), level(1));
            [a, b, c, d, e, f, g, h]
        };
        let hexahedra: Vec<[u32; 8]> = grid([nx - 1, ny - 1, nz - 1]).map(hexahedron).collect();
        Ok(match self.split {
            HexSplit::Six => hexahedra::six(nodes, &hexahedra).with_surfaces(|_, normal| {
                const NAMES: [[&str; 2]; 3] =
                    [["left", "right"], ["front", "back"], ["bottom", "top"]];
                let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))?;
                Some(NAMES[axis][usize::from(normal[axis] > 0.0)])
            }),
            HexSplit::Twelve => {
                let sides = ["bottom", "top", "front", "right", "back", "left"];
                hexahedra::twelve(nodes, &hexahedra, sides)
            }
        })
    }
}
