//! Chebyshev smoother for a matrix A, with residuals scaled by D⁻¹, the inverse of its (block) diagonal.
//!
//! Reference: Adams, Brezina, Hu & Tuminaro, J. Comput. Phys. 188 (2003) 593,
//! doi:10.1016/S0021-9991(03)00194-3.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::Pod;
use nalgebra::{DMatrix, RealField, convert};
use rayon::prelude::*;

use super::block_csr::{BlockCsr, inverse};
use super::vector::{CHUNK, by_node};
use crate::parallel::Halo;

/// The smoother reduces error components whose eigenvalues exceed this fraction of the largest eigenvalue.
const SHARE: f64 = 0.1;
const LANCZOS_STEPS: usize = 12;
/// Safety factor of the largest eigenvalue, because Lanczos' iteration underestimates it.
const MARGIN: f64 = 1.1;

/// Improves the approximate solution x of A x = b by a polynomial of the given degree.
///
/// On input, `residual` is b − A x; its content is destroyed. `step` is a work vector of the same length.
/// `subtract(x, y)` computes y ← y − A x, and `scale(node, r)` returns the values of D⁻¹ r at a node.
pub(super) fn smooth<T: RealField + Copy, const R: usize>(
    largest: f64,
    degree: usize,
    mut subtract: impl FnMut(&[[T; R]], &mut [[T; R]]),
    scale: impl Fn(usize, &[T; R]) -> [T; R] + Sync,
    [residual, step, x]: [&mut [[T; R]]; 3],
) {
    for (k, (momentum, weight)) in coefficients(largest, degree).enumerate() {
        if k > 0 {
            subtract(step, residual);
        }
        let (momentum, weight): (T, T) = (convert(momentum), convert(weight));
        let chunks = step.par_chunks_mut(CHUNK).zip(x.par_chunks_mut(CHUNK));
        chunks.zip(residual.par_chunks(CHUNK)).enumerate().for_each(|(chunk, ((step, x), r))| {
            for (node, ((step, x), r)) in (CHUNK * chunk..).zip(step.iter_mut().zip(x).zip(r)) {
                let scaled = scale(node, r);
                for i in 0..R {
                    let before = if k == 0 { T::zero() } else { momentum * step[i] };
                    step[i] = before + weight * scaled[i];
                    x[i] += step[i];
                }
            }
        });
    }
}

/// Returns (momentum, weight) for each step: d ← momentum d + weight D⁻¹ r.
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

/// Returns an upper bound of the eigenvalues of D⁻¹ A on `nodes` nodes, by Lanczos' iteration in the inner product of
/// D. The functions are those of [`smooth`].
///
/// Damage causes a few large, isolated eigenvalues. Lanczos' iteration finds them in these few steps; a power
/// iteration would need a number of steps that grows with the number of nodes, and a Chebyshev polynomial amplifies
/// components above the bound.
pub(super) fn largest_eigenvalue<T: RealField + Pod + Into<f64>, const R: usize>(
    halo: &Halo,
    nodes: usize,
    mut subtract: impl FnMut(&[[T; R]], &mut [[T; R]]),
    scale: impl Fn(usize, &[T; R]) -> [T; R] + Sync,
) -> f64 {
    let dot = |a: &[[T; R]], b: &[[T; R]]| {
        let part = |nodes: Range<usize>| -> f64 {
            let pairs = a[nodes.clone()].iter().flatten().zip(b[nodes].iter().flatten());
            pairs.map(|(&a, &b)| a.into() * b.into()).sum()
        };
        let mut sum = [match halo.ranks().is_alone() {
            true => {
                let firsts: Vec<usize> = (0..nodes).step_by(CHUNK).collect();
                let parts = firsts.par_iter().map(|&n| part(n..nodes.min(n + CHUNK)));
                parts.collect::<Vec<f64>>().iter().sum::<f64>()
            }
            false => halo.own(nodes).into_iter().map(part).sum(),
        }];
        halo.ranks().sum(&mut sum);
        sum[0]
    };
    // the start vector must not be orthogonal to the rough eigenvectors; it is deterministic
    let start = |node, k| convert((((node * R + k) as f64) * 1.7 + 0.3).sin());
    let of_node = |node| std::array::from_fn(|k| start(node, k));
    let mut d: Vec<[T; R]> = (0..nodes).into_par_iter().with_min_len(CHUNK).map(of_node).collect();
    halo.forward(&mut d);
    let [mut before, mut v, mut w] = [(); 3].map(|()| vec![[T::zero(); R]; nodes]);
    let mut lanczos = Lanczos::default();
    loop {
        v.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(node, v)| {
            *v = scale(node, &d[node]);
        });
        let size = dot(&d, &v).sqrt();
        if lanczos.is_done(size) {
            return lanczos.bound();
        }
        let normalise: T = convert(1.0 / size);
        for x in [&mut d, &mut v] {
            let values = x.par_iter_mut().with_min_len(CHUNK);
            values.for_each(|x| *x = x.map(|x| normalise * x));
        }
        w.par_iter_mut().with_min_len(CHUNK).for_each(|w| *w = [T::zero(); R]);
        subtract(&v, &mut w);
        let product = -dot(&w, &v);
        let (of_d, of_before): (T, T) = (convert(product), convert(lanczos.push(size, product)));
        let next = before.par_iter_mut().with_min_len(CHUNK).zip(&w).zip(&d);
        next.for_each(|((before, w), d)| {
            (0..R).for_each(|k| before[k] = -w[k] - of_d * d[k] - of_before * before[k]);
        });
        std::mem::swap(&mut before, &mut d);
    }
}

/// Tridiagonal matrix of Lanczos' iteration; its largest eigenvalue converges to that of D⁻¹ A.
#[derive(Debug, Default)]
pub(super) struct Lanczos {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Lanczos {
    /// Whether the iteration is complete, given the norm `size` of the next vector.
    pub(super) fn is_done(&self, size: f64) -> bool {
        size.is_nan() || size == 0.0 || self.diagonal.len() == LANCZOS_STEPS
    }

    /// Adds a vector with norm `size` before normalisation, and its product vᵀ A v. Returns the coefficient of the
    /// previous vector in the next one.
    pub(super) fn push(&mut self, size: f64, product: f64) -> f64 {
        let first = self.diagonal.is_empty();
        self.diagonal.push(product);
        if first {
            return 0.0;
        }
        self.beside.push(size);
        size
    }

    /// Returns the upper bound of the eigenvalues.
    pub(super) fn bound(&self) -> f64 {
        if self.diagonal.is_empty() {
            return MARGIN;
        }
        let matrix = DMatrix::from_fn(self.diagonal.len(), self.diagonal.len(), |i, j| {
            match i.abs_diff(j) {
                0 => self.diagonal[i],
                1 => self.beside[i.min(j)],
                _ => 0.0,
            }
        });
        let largest = matrix.symmetric_eigenvalues().iter().fold(0.0f64, |m, &v| m.max(v));
        MARGIN * if largest > 0.0 { largest } else { 1.0 }
    }
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

/// Assembled matrix in single precision, or this rank's part of it, with the data of its smoother.
#[derive(Debug)]
pub(super) struct Chebyshev<const R: usize> {
    pub(super) matrix: BlockCsr<f32, R, R>,
    pub(super) inverse: Vec<[[f32; R]; R]>,
    /// Upper bound of the eigenvalues of D⁻¹ A, where D contains the diagonal blocks of A.
    pub(super) largest: f64,
    halo: Arc<Halo>,
}

impl<const R: usize> Chebyshev<R> {
    pub(super) fn new(matrix: &BlockCsr<f64, R, R>, halo: &Arc<Halo>) -> Self {
        let narrow = |block: &_| inverse(block).map(|r| r.map(|x| x as f32));
        let inverse = by_node(&diagonal_blocks(matrix, halo), narrow);
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

    /// Smooths as the function [`smooth`] does.
    pub(super) fn smooth(&self, degree: usize, residual: &mut [[f32; R]], x: &mut [[f32; R]]) {
        let subtract = |x: &[_], y: &mut [_]| self.subtract(x, y);
        let scale = |row, r: &[f32; R]| self.scale(row, r);
        let mut step = vec![[0.0; R]; x.len()];
        smooth(self.largest, degree, subtract, scale, [residual, &mut step, x]);
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/chebyshev.rs"]
mod tests;
