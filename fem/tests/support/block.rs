//! Meshes of blocks on a graded grid; every face of a block is a named surface.
#![allow(dead_code)] // each test or benchmark uses only some of the functions

use fem::{Block, HexSplit, TetMesh};

/// A block with grid planes at these coordinates, mm; each cell is divided into six tetrahedra.
pub(crate) fn block(grid: [&[f64]; 3]) -> TetMesh {
    let block = Block { planes_mm: grid.map(<[f64]>::to_vec), split: HexSplit::Six };
    block.build().expect("increasing coordinates")
}

/// Coordinates of the planes of n equal cells.
pub(crate) fn even(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect()
}

/// Coordinates of planes from zero: `fine` cells of size `h`, then cells that grow by the factor `growth` up to `to`.
pub(crate) fn graded(h: f64, fine: usize, growth: f64, to: f64) -> Vec<f64> {
    let mut coordinates: Vec<f64> = (0..=fine).map(|k| k as f64 * h).collect();
    let mut step = h;
    loop {
        step *= growth;
        let last = coordinates[coordinates.len() - 1];
        if last + 1.5 * step >= to {
            coordinates.push(to);
            return coordinates;
        }
        coordinates.push(last + step);
    }
}
