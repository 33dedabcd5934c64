//! Block-sparse matrices in compressed row storage.

use fem_mesh::Groups;
use rayon::prelude::*;

/// A sparse matrix of R × C blocks.
#[derive(Clone, Debug)]
pub(crate) struct BlockCsr<T, const R: usize, const C: usize> {
    /// Number of block columns.
    pub(crate) columns: usize,
    /// Offsets of the block rows in `column` and `block`; length: number of block rows + 1.
    pub(crate) start: Vec<u32>,
    /// Block column of each block.
    pub(crate) column: Vec<u32>,
    /// The blocks. The entries of a block are stored row by row.
    pub(crate) block: Vec<[[T; C]; R]>,
}

/// Number of block rows per parallel task.
const ROWS: usize = 512;

impl<T: Copy, const R: usize, const C: usize> BlockCsr<T, R, C> {
    pub(crate) fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// Iterates over the blocks of a block row, each with its block column.
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (usize, &[[T; C]; R])> {
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        self.column[range.clone()].iter().map(|&c| c as usize).zip(&self.block[range])
    }
}

impl<const R: usize, const C: usize> BlockCsr<f64, R, C> {
    pub(super) fn transpose(&self) -> BlockCsr<f64, C, R> {
        let rows = (0..self.rows()).flat_map(|row| self.row(row).map(move |_| row as u32));
        let rows: Vec<u32> = rows.collect();
        let Groups { start, members } =
            Groups::new(self.columns, self.column.iter().copied().zip(0..));
        let transposed =
            |b: &[[f64; C]; R]| std::array::from_fn(|j| std::array::from_fn(|i| b[i][j]));
        BlockCsr {
            columns: self.rows(),
            start,
            column: members.iter().map(|&entry| rows[entry as usize]).collect(),
            block: members.iter().map(|&entry| transposed(&self.block[entry as usize])).collect(),
        }
    }

    pub(super) fn multiply<const K: usize>(
        &self,
        other: &BlockCsr<f64, C, K>,
    ) -> BlockCsr<f64, R, K> {
        let mut product = self.structure_of_product(other);
        let mut chunks = Vec::new();
        let mut rest = product.block.as_mut_slice();
        for first in (0..self.rows()).step_by(ROWS) {
            let last = self.rows().min(first + ROWS);
            let count = product.start[last] - product.start[first];
            let (chunk, next) = rest.split_at_mut(count as usize);
            chunks.push((first..last, chunk));
            rest = next;
        }
        let (start, column) = (&product.start, &product.column);
        chunks.into_par_iter().for_each_init(
            || vec![0u32; other.columns],
            |position, (rows, blocks)| {
                let begin = start[rows.start] as usize;
                for row in rows {
                    let range = start[row] as usize..start[row + 1] as usize;
                    let blocks = &mut blocks[range.start - begin..range.end - begin];
                    for (&c, i) in column[range].iter().zip(0..) {
                        position[c as usize] = i;
                    }
                    for (middle, a) in self.row(row) {
                        for (c, b) in other.row(middle) {
                            add_product(&mut blocks[position[c] as usize], a, b);
                        }
                    }
                }
            },
        );
        product
    }

    /// Returns the sparsity structure of the product with another matrix, as a matrix of zero blocks.
    fn structure_of_product<const K: usize>(
        &self,
        other: &BlockCsr<f64, C, K>,
    ) -> BlockCsr<f64, R, K> {
        let chunks: Vec<usize> = (0..self.rows()).step_by(ROWS).collect();
        let structures: Vec<_> = chunks
            .into_par_iter()
            .map(|first| {
                let (mut ends, mut column) = (Vec::new(), Vec::new());
                // for each column, the index of the last row that has an entry in this column
                let mut seen = vec![usize::MAX; other.columns];
                for row in first..self.rows().min(first + ROWS) {
                    for (middle, _) in self.row(row) {
                        for (c, _) in other.row(middle) {
                            if seen[c] != row {
                                seen[c] = row;
                                column.push(c as u32);
                            }
                        }
                    }
                    ends.push(column.len() as u32);
                }
                (ends, column)
            })
            .collect();
        let mut start = vec![0];
        let mut column = Vec::new();
        for (ends, columns) in structures {
            let begin = column.len() as u32;
            start.extend(ends.iter().map(|end| begin + end));
            column.extend(columns);
        }
        let block = vec![[[0.0; K]; R]; column.len()];
        BlockCsr { columns: other.columns, start, column, block }
    }

    /// Converts the matrix to single precision.
    pub(super) fn narrow(&self) -> BlockCsr<f32, R, C> {
        BlockCsr {
            columns: self.columns,
            start: self.start.clone(),
            column: self.column.clone(),
            block: self.block.iter().map(|b| b.map(|row| row.map(|x| x as f32))).collect(),
        }
    }

    /// Returns a matrix of the first `rows` block rows.
    pub(super) fn first_rows(&self, rows: usize) -> Self {
        let end = self.start[rows] as usize;
        Self {
            columns: self.columns,
            start: self.start[..=rows].to_vec(),
            column: self.column[..end].to_vec(),
            block: self.block[..end].to_vec(),
        }
    }

    /// Returns the diagonal block of a row, if the row has one.
    pub(super) fn diagonal(&self, row: usize) -> Option<&[[f64; C]; R]> {
        self.row(row).find(|(c, _)| *c == row).map(|(_, b)| b)
    }
}

impl<const R: usize, const C: usize> BlockCsr<f32, R, C> {
    /// Computes A x and updates y row by row: `into` gets each row of y and the corresponding row of A x.
    pub(super) fn apply(
        &self,
        x: &[[f32; C]],
        y: &mut [[f32; R]],
        into: impl Fn(&mut [f32; R], [f32; R]) + Sync,
    ) {
        y.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let mut sum = [0.0; R];
                for (column, block) in self.row(chunk * ROWS + i) {
                    let x = &x[column];
                    for i in 0..R {
                        for j in 0..C {
                            sum[i] += block[i][j] * x[j];
                        }
                    }
                }
                into(y, sum);
            }
        });
    }
}

#[inline(always)]
fn add_product<const R: usize, const C: usize, const K: usize>(
    sum: &mut [[f64; K]; R],
    a: &[[f64; C]; R],
    b: &[[f64; K]; C],
) {
    for i in 0..R {
        for j in 0..C {
            for k in 0..K {
                sum[i][k] += a[i][j] * b[j][k];
            }
        }
    }
}

/// Returns the inverse of a small symmetric block, by elimination with diagonal pivots. If a pivot is zero, its row
/// and column of the inverse are set to zero, so that the corresponding unknown does not change.
pub(super) fn inverse<const R: usize>(block: &[[f64; R]; R]) -> [[f64; R]; R] {
    let size = block.iter().flatten().fold(0.0f64, |m, x| m.max(x.abs()));
    let mut a = *block;
    let mut b: [[f64; R]; R] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
    let mut dropped = [false; R];
    for k in 0..R {
        // diagonal pivots are stable because the blocks are definite
        let pivot = a[k][k];
        if pivot.abs() <= 1e-12 * size || !pivot.is_finite() {
            dropped[k] = true;
            continue;
        }
        for j in 0..R {
            a[k][j] /= pivot;
            b[k][j] /= pivot;
        }
        for i in (0..R).filter(|&i| i != k) {
            let factor = a[i][k];
            for j in 0..R {
                a[i][j] -= factor * a[k][j];
                b[i][j] -= factor * b[k][j];
            }
        }
    }
    for k in (0..R).filter(|&k| dropped[k]) {
        b[k] = [0.0; R];
        b.iter_mut().for_each(|row| row[k] = 0.0);
    }
    b
}

#[cfg(test)]
#[path = "../../../../tests/unit/block_csr.rs"]
mod tests;
