//! Assembled matrix of a multigrid level in single precision.

use std::sync::Arc;

use rayon::prelude::*;

use super::super::in_memory::{CHUNK, InMemory, Real, by_node};
use super::block_csr::{BlockCsr, inverse};
use super::matrix::{Matrix, Relaxation};
use crate::parallel::Halo;

/// Matrix of a level, or this rank's contribution to this matrix, with the inverses of the diagonal blocks.
#[derive(Debug)]
pub(crate) struct Assembled<const R: usize> {
    pub(crate) matrix: BlockCsr<f32, R, R>,
    pub(crate) inverse: Vec<[[f32; R]; R]>,
    halo: Arc<Halo>,
}

impl<const R: usize> Assembled<R> {
    /// Converts a matrix to single precision. `diagonal` contains its [`diagonal_blocks`].
    pub(super) fn new(
        matrix: &BlockCsr<f64, R, R>,
        diagonal: &[[[f64; R]; R]],
        halo: &Arc<Halo>,
    ) -> Self {
        let inverse = by_node(diagonal, |block| inverse(block).map(|r| r.map(|x| x as f32)));
        Self { matrix: matrix.narrow(), inverse, halo: Arc::clone(halo) }
    }
}

impl<const R: usize> Matrix for Assembled<R> {
    type Space = InMemory<f32, R>;

    fn subtract(&mut self, x: &[[f32; R]], y: &mut [[f32; R]]) {
        if self.halo.ranks().is_alone() {
            return self.matrix.apply(x, y, |y, ax| (0..R).for_each(|i| y[i] -= ax[i]));
        }
        let mut product = vec![[0.0; R]; y.len()];
        self.matrix.apply(x, &mut product, |y, ax| *y = ax);
        self.halo.complete(&mut product);
        y.iter_mut().flatten().zip(product.iter().flatten()).for_each(|(y, ax)| *y -= ax);
    }

    fn relax(
        &self,
        coefficients: Relaxation,
        r: &[[f32; R]],
        step: &mut [[f32; R]],
        x: &mut [[f32; R]],
    ) {
        let scale = |row: usize, r: &[f32; R]| -> [f32; R] {
            let inverse = &self.inverse[row];
            std::array::from_fn(|i| (0..R).map(|j| inverse[i][j] * r[j]).sum())
        };
        relax(coefficients, scale, r, step, x);
    }
}

/// Computes [`Matrix::relax`] in the memory of this process. `scale(node, r)` returns the values of D⁻¹ r at a node,
/// where D is the (block) diagonal of the matrix.
pub(super) fn relax<T: Real, const R: usize>(
    Relaxation { momentum, weight }: Relaxation,
    scale: impl Fn(usize, &[T; R]) -> [T; R] + Sync,
    r: &[[T; R]],
    step: &mut [[T; R]],
    x: &mut [[T; R]],
) {
    let (first, momentum, weight) = (
        momentum == 0.0,
        nalgebra::convert::<f64, T>(momentum),
        nalgebra::convert::<f64, T>(weight),
    );
    let chunks = step.par_chunks_mut(CHUNK).zip(x.par_chunks_mut(CHUNK));
    chunks.zip(r.par_chunks(CHUNK)).enumerate().for_each(|(chunk, ((step, x), r))| {
        for (node, ((step, x), r)) in (CHUNK * chunk..).zip(step.iter_mut().zip(x).zip(r)) {
            let scaled = scale(node, r);
            for i in 0..R {
                let before = if first { T::zero() } else { momentum * step[i] };
                step[i] = before + weight * scaled[i];
                x[i] += step[i];
            }
        }
    });
}

/// Returns the diagonal blocks of a matrix that is distributed over the ranks.
pub(super) fn diagonal_blocks<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    halo: &Halo,
) -> Vec<[[f64; R]; R]> {
    let block = |row| matrix.diagonal(row).copied().unwrap_or([[0.0; R]; R]);
    let mut blocks: Vec<_> = (0..matrix.rows()).map(block).collect();
    halo.complete_blocks(&mut blocks);
    blocks
}
