//! Blocks on a graded grid, with every face a named surface.
#![allow(dead_code)] // each user takes a part

use fem::{Block, HexSplit, TetMesh};

/// The block between the first and the last coordinates, six tetrahedra a cell.
pub(crate) fn block(grid: [&[f64]; 3]) -> TetMesh {
    let block = Block { planes_mm: grid.map(<[f64]>::to_vec), split: HexSplit::Six };
    block.build().expect("increasing coordinates")
}

/// n equal cells between two ends.
pub(crate) fn even(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect()
}

/// `fine` cells of size `h` from zero, then cells that grow by `growth` until `to` is reached.
pub(crate) fn graded(h: f64, fine: usize, growth: f64, to: f64) -> Vec<f64> {
    let mut points: Vec<f64> = (0..=fine).map(|k| k as f64 * h).collect();
    let mut step = h;
    loop {
        step *= growth;
        let last = points[points.len() - 1];
        if last + 1.5 * step >= to {
            points.push(to);
            return points;
        }
        points.push(last + step);
    }
}
