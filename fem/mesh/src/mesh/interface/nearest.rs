//! Distance of points from the pieces of a surface, by a grid of cells.

use std::collections::HashMap;

use crate::mesh::triangle::nearest;
use crate::mesh::vector::{Point, norm, sub};

/// Piece of an interface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece {
    Triangle([Point; 3]),
    /// Surface of a ball: its centre and its radius (mm).
    Ball(Point, f64),
}

impl Piece {
    fn distance(&self, x: Point) -> f64 {
        match self {
            Piece::Triangle(corners) => norm(sub(nearest(*corners, x).0, x)),
            Piece::Ball(centre, radius) => (norm(sub(x, *centre)) - radius).max(0.0),
        }
    }

    /// Returns the minimum and maximum coordinates.
    fn bounds(&self) -> [Point; 2] {
        match self {
            Piece::Triangle([a, b, c]) => [
                std::array::from_fn(|k| a[k].min(b[k]).min(c[k])),
                std::array::from_fn(|k| a[k].max(b[k]).max(c[k])),
            ],
            Piece::Ball(centre, radius) => [centre.map(|x| x - radius), centre.map(|x| x + radius)],
        }
    }
}

/// Cells of equal size, each with the pieces of the surface that lie in the cell.
pub(super) struct Grid<'a> {
    pieces: &'a [Piece],
    /// Edge of a cell (mm), at least the largest distance that is searched.
    cell_mm: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl<'a> Grid<'a> {
    /// Creates a grid that finds distances below `cell_mm`, which must be positive.
    pub(super) fn new(pieces: &'a [Piece], cell_mm: f64) -> Self {
        let mut grid = Grid { pieces, cell_mm, cells: HashMap::new() };
        for (number, piece) in pieces.iter().enumerate() {
            let [low, high] = piece.bounds().map(|x| grid.cell_of(x));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    for k in low[2]..=high[2] {
                        grid.cells.entry([i, j, k]).or_default().push(number as u32);
                    }
                }
            }
        }
        grid
    }

    fn cell_of(&self, x: Point) -> [i64; 3] {
        x.map(|x| (x / self.cell_mm).floor() as i64)
    }

    /// Returns the distance (mm) of a point from the nearest piece. A distance above the size of a cell may be too
    /// large, or infinite.
    pub(super) fn distance(&self, x: Point) -> f64 {
        let [i, j, k] = self.cell_of(x);
        let mut least = f64::INFINITY;
        for di in -1..=1 {
            for dj in -1..=1 {
                for dk in -1..=1 {
                    let Some(piece_ids) = self.cells.get(&[i + di, j + dj, k + dk]) else {
                        continue;
                    };
                    for &piece_id in piece_ids {
                        least = least.min(self.pieces[piece_id as usize].distance(x));
                    }
                }
            }
        }
        least
    }
}
