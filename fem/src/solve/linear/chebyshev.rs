//! Chebyshev smoothing of a matrix A whose residuals are scaled by D⁻¹, the inverse of its diagonal.
//!
//! Reference: Adams, Brezina, Hu & Tuminaro, J. Comput. Phys. 188 (2003) 593,
//! doi:10.1016/S0021-9991(03)00194-3.

use std::sync::Arc;

use bytemuck::Pod;
use nalgebra::{RealField, convert};
use rayon::prelude::*;

use super::block_csr::{BlockCsr, inverse};
use super::vector::CHUNK;
use crate::parallel::Halo;

/// The smoother acts on eigenvalues above this share of the largest.
const SHARE: f64 = 0.1;
pub(super) const POWER_STEPS: usize = 12;
/// The power iteration stays below the largest eigenvalue.
pub(super) const MARGIN: f64 = 1.1;

/// Improves x towards A x = b by a polynomial of the given degree.
///
/// `residual` holds b − A x, and afterwards no longer does; `subtract(x, y)` is y ← y − A x and
/// `scale(node, r)` the node's part of D⁻¹ r.
pub(super) fn smooth<T: RealField + Copy, const R: usize>(
    largest: f64,
    degree: usize,
    mut subtract: impl FnMut(&[[T; R]], &mut [[T; R]]),
    scale: impl Fn(usize, &[T; R]) -> [T; R] + Sync,
    residual: &mut [[T; R]],
    x: &mut [[T; R]],
) {
    let mut step = vec![[T::zero(); R]; x.len()];
    for (k, (momentum, weight)) in coefficients(largest, degree).enumerate() {
        if k > 0 {
            subtract(&step, residual);
        }
        let (momentum, weight): (T, T) = (convert(momentum), convert(weight));
        let chunks = step.par_chunks_mut(CHUNK).zip(x.par_chunks_mut(CHUNK));
        chunks.zip(residual.par_chunks(CHUNK)).enumerate().for_each(|(chunk, ((step, x), r))| {
            for (node, ((step, x), r)) in (CHUNK * chunk..).zip(step.iter_mut().zip(x).zip(r)) {
                let scaled = scale(node, r);
                for i in 0..R {
                    step[i] = momentum * step[i] + weight * scaled[i];
                    x[i] += step[i];
                }
            }
        });
    }
}

/// (momentum, weight) of each step: d ← momentum d + weight D⁻¹ r.
pub(super) fn coefficients(largest: f64, degree: usize) -> impl Iterator<Item = (f64, f64)> {
    let (low, high) = (SHARE * largest, largest);
    let (centre, half) = (0.5 * (high + low), 0.5 * (high - low));
    let sigma = centre / half;
    let mut rho = 1.0 / sigma;
    let later = (1..degree).map(move |_| {
        let next = 1.0 / (2.0 * sigma - rho);
        let step = (next * rho, 2.0 * next / half);
        rho = next;
        step
    });
    std::iter::once((0.0, 1.0 / centre)).chain(later)
}

/// An upper bound of the eigenvalues of D⁻¹ A on so many nodes, by power iteration; the functions are
/// those of [`smooth`].
pub(super) fn largest_eigenvalue<T: RealField + Pod + Into<f64>, const R: usize>(
    halo: &Halo,
    nodes: usize,
    mut subtract: impl FnMut(&[[T; R]], &mut [[T; R]]),
    scale: impl Fn(usize, &[T; R]) -> [T; R],
) -> f64 {
    let norm = |v: &[[T; R]]| {
        let mut sum = [halo.own_of(v).flatten().map(|&v| v.into() * v.into()).sum::<f64>()];
        halo.ranks().sum(&mut sum);
        sum[0].sqrt()
    };
    // any start that is not orthogonal to the rough vectors; no random numbers needed
    let start = |node, k| convert((((node * R + k) as f64) * 1.7 + 0.3).sin());
    let mut x: Vec<[T; R]> =
        (0..nodes).map(|node| std::array::from_fn(|k| start(node, k))).collect();
    halo.forward(&mut x);
    let mut largest = 1.0;
    for _ in 0..POWER_STEPS {
        let mut y = vec![[T::zero(); R]; nodes];
        subtract(&x, &mut y);
        y.iter_mut().enumerate().for_each(|(node, y)| *y = scale(node, y));
        let (before, after) = (norm(&x), norm(&y));
        if after == 0.0 || before == 0.0 {
            break;
        }
        largest = after / before;
        let normalise: T = convert(1.0 / after);
        x = y.into_iter().map(|y| y.map(|v| normalise * v)).collect();
    }
    MARGIN * largest
}

/// The diagonal blocks of a matrix of which every rank has a part.
pub(super) fn diagonal_blocks<const R: usize>(
    matrix: &BlockCsr<f64, R, R>,
    halo: &Halo,
) -> Vec<[[f64; R]; R]> {
    let block = |row| matrix.diagonal(row).copied().unwrap_or([[0.0; R]; R]);
    let mut blocks: Vec<_> = (0..matrix.rows()).map(block).collect();
    halo.complete_blocks(&mut blocks);
    blocks
}

/// An assembled matrix in single precision, or this rank's part of it, with what its smoother needs.
#[derive(Debug)]
pub(super) struct Chebyshev<const R: usize> {
    pub(super) matrix: BlockCsr<f32, R, R>,
    pub(super) inverse: Vec<[[f32; R]; R]>,
    /// Upper bound of the eigenvalues of D⁻¹ A, with its diagonal blocks D.
    pub(super) largest: f64,
    halo: Arc<Halo>,
}

impl<const R: usize> Chebyshev<R> {
    pub(super) fn new(matrix: &BlockCsr<f64, R, R>, halo: &Arc<Halo>) -> Self {
        let narrow = |block: &_| inverse(block).map(|r| r.map(|x| x as f32));
        let inverse = diagonal_blocks(matrix, halo).iter().map(narrow).collect();
        let halo = Arc::clone(halo);
        let mut this = Self { matrix: matrix.narrow(), inverse, largest: 1.0, halo };
        let subtract = |x: &[_], y: &mut [_]| this.subtract(x, y);
        let scale = |row, r: &_| this.scale(row, r);
        this.largest = largest_eigenvalue(&this.halo, matrix.rows(), subtract, scale);
        this
    }

    /// y ← y − A x.
    pub(super) fn subtract(&self, x: &[[f32; R]], y: &mut [[f32; R]]) {
        if self.halo.ranks().is_alone() {
            return self.matrix.apply(x, y, |y, ax| (0..R).for_each(|i| y[i] -= ax[i]));
        }
        let mut product = vec![[0.0; R]; y.len()];
        self.matrix.apply(x, &mut product, |y, ax| *y = ax);
        self.halo.complete(&mut product);
        y.iter_mut().flatten().zip(product.iter().flatten()).for_each(|(y, ax)| *y -= ax);
    }

    fn scale(&self, row: usize, r: &[f32; R]) -> [f32; R] {
        let inverse = &self.inverse[row];
        std::array::from_fn(|i| (0..R).map(|j| inverse[i][j] * r[j]).sum())
    }

    /// As [`smooth`] does.
    pub(super) fn smooth(&self, degree: usize, residual: &mut [[f32; R]], x: &mut [[f32; R]]) {
        let subtract = |x: &[_], y: &mut [_]| self.subtract(x, y);
        smooth(self.largest, degree, subtract, |row, r| self.scale(row, r), residual, x);
    }
}
