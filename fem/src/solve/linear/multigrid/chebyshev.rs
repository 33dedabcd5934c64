//! Chebyshev smoother for a matrix A, with residuals scaled by D⁻¹, the inverse of its (block) diagonal.
//!
//! Reference: Adams, Brezina, Hu & Tuminaro, J. Comput. Phys. 188 (2003) 593,
//! doi:10.1016/S0021-9991(03)00194-3.

use std::borrow::{Borrow, BorrowMut};

use nalgebra::DMatrix;

use super::super::vectors::{LanczosVectors, Vectors};
use super::matrix::{Matrix, Preconditioner, Relaxation, Vector};

/// The smoother reduces the components of the error that belong to eigenvalues above this fraction of the largest
/// eigenvalue.
const SHARE: f64 = 0.1;
/// Number of steps of Lanczos' iteration.
const LANCZOS_STEPS: usize = 12;
/// Safety factor by which the estimate of the largest eigenvalue is multiplied: Lanczos' iteration underestimates this
/// eigenvalue.
const MARGIN: f64 = 1.1;

/// Chebyshev smoother for the matrix of one level: the coefficients of its steps, and a work vector.
#[derive(Debug)]
pub(crate) struct Smoother<S: Vectors> {
    pub(crate) degree: usize,
    /// Upper bound of the eigenvalues of D⁻¹ A, where D is the (block) diagonal of the matrix A.
    pub(crate) largest: f64,
    /// Work vector.
    step: S::Owned,
}

impl<S: Vectors> Smoother<S> {
    /// Creates the smoother of a matrix and estimates its largest eigenvalue. `like` is any vector of the right length.
    pub(crate) fn measured<M: Matrix<Space = S>>(
        vectors: &S,
        matrix: &mut M,
        degree: usize,
        like: &S::Vector,
    ) -> Self
    where
        S: LanczosVectors,
    {
        let largest = largest_eigenvalue(vectors, matrix, like);
        Self { degree, largest, step: vectors.zero(like) }
    }

    /// Creates a smoother for eigenvalues up to the given bound `largest`; `step` is a work vector.
    pub(crate) fn new(degree: usize, largest: f64, step: S::Owned) -> Self {
        Self { degree, largest, step }
    }

    /// Improves the approximate solution x of A x = b. On input, `residual` is b − A x; its content is overwritten.
    pub(crate) fn smooth<M: Matrix<Space = S>>(
        &mut self,
        matrix: &mut M,
        residual: &mut S::Vector,
        x: &mut S::Vector,
    ) {
        let step = self.step.borrow_mut();
        for (k, relaxation) in relaxations(self.largest, self.degree).enumerate() {
            if k > 0 {
                matrix.subtract(step, residual);
            }
            matrix.relax(relaxation, residual, step, x);
        }
    }
}

/// Returns the coefficients of the smoothing steps that apply a Chebyshev polynomial.
fn relaxations(largest: f64, degree: usize) -> impl Iterator<Item = Relaxation> {
    let (low, high) = (SHARE * largest, largest);
    let (centre, half) = (0.5 * (high + low), 0.5 * (high - low));
    let sigma = centre / half;
    let mut rho = 1.0 / sigma;
    let later = (1..degree).map(move |_| {
        let next = 1.0 / (2.0 * sigma - rho);
        let step = Relaxation { momentum: next * rho, weight: 2.0 * next / half };
        rho = next;
        step
    });
    std::iter::once(Relaxation { momentum: 0.0, weight: 1.0 / centre }).chain(later)
}

/// Returns an upper bound of the eigenvalues of D⁻¹ A, by Lanczos' iteration in the inner product of D. `like` is any
/// vector of the right length.
///
/// Damage causes a few large, isolated eigenvalues. Lanczos' iteration converges to these eigenvalues in
/// [`LANCZOS_STEPS`] steps; the number of steps of a power iteration would increase with the number of nodes. The bound
/// must not be too small, because a Chebyshev polynomial amplifies components with eigenvalues above the bound.
fn largest_eigenvalue<M: Matrix<Space: LanczosVectors>>(
    vectors: &M::Space,
    matrix: &mut M,
    like: &Vector<M>,
) -> f64 {
    let [mut d, mut before, mut v, mut w] = [(); 4].map(|()| vectors.zero(like));
    let (v, w) = (v.borrow_mut(), w.borrow_mut());
    // choose a deterministic start vector that varies from node to node, as eigenvectors of the largest eigenvalues do
    vectors.fill(d.borrow_mut(), |i| ((i as f64) * 1.7 + 0.3).sin());
    let mut lanczos = Lanczos::default();
    loop {
        // compute v = D⁻¹ d; w receives a sum that is not used
        matrix.relax(Relaxation { momentum: 0.0, weight: 1.0 }, d.borrow(), v, w);
        let size = vectors.dot(d.borrow(), v).sqrt();
        if lanczos.is_done(size) {
            return lanczos.bound();
        }
        vectors.scale(d.borrow_mut(), 1.0 / size);
        vectors.scale(v, 1.0 / size);
        vectors.clear(w);
        matrix.subtract(v, w);
        let product = -vectors.dot(w, v);
        let off_diagonal = lanczos.push(size, product);
        vectors.recur(before.borrow_mut(), w, product, d.borrow(), off_diagonal);
        std::mem::swap(&mut before, &mut d);
    }
}

/// Tridiagonal matrix that Lanczos' iteration builds. The largest eigenvalue of this matrix converges to the largest
/// eigenvalue of D⁻¹ A.
#[derive(Debug, Default)]
struct Lanczos {
    diagonal: Vec<f64>,
    off_diagonal: Vec<f64>,
}

impl Lanczos {
    /// Whether the iteration is complete, given the norm `size` of the next vector.
    fn is_done(&self, size: f64) -> bool {
        size.is_nan() || size == 0.0 || self.diagonal.len() == LANCZOS_STEPS
    }

    /// Adds a row and a column for a Lanczos vector v, given by its norm `size` before normalisation and by `product` =
    /// vᵀ A v. Returns the coefficient with which the previous vector occurs in the recurrence for the next vector.
    fn push(&mut self, size: f64, product: f64) -> f64 {
        let first = self.diagonal.is_empty();
        self.diagonal.push(product);
        if first {
            return 0.0;
        }
        self.off_diagonal.push(size);
        size
    }

    /// Returns the upper bound of the eigenvalues of D⁻¹ A.
    fn bound(&self) -> f64 {
        if self.diagonal.is_empty() {
            return MARGIN;
        }
        let matrix = DMatrix::from_fn(self.diagonal.len(), self.diagonal.len(), |i, j| {
            match i.abs_diff(j) {
                0 => self.diagonal[i],
                1 => self.off_diagonal[i.min(j)],
                _ => 0.0,
            }
        });
        let largest = matrix.symmetric_eigenvalues().iter().fold(0.0f64, |m, &v| m.max(v));
        MARGIN * if largest > 0.0 { largest } else { 1.0 }
    }
}

/// Preconditioner that consists of smoothing steps only.
#[derive(Debug)]
pub(crate) struct Smoothing<M: Matrix> {
    pub(crate) vectors: M::Space,
    pub(crate) matrix: M,
    pub(crate) smoother: Smoother<M::Space>,
}

impl<M: Matrix> Preconditioner for Smoothing<M> {
    type Space = M::Space;

    fn apply(&mut self, b: &mut Vector<M>, x: &mut Vector<M>) {
        self.vectors.clear(x);
        self.smoother.smooth(&mut self.matrix, b, x);
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/chebyshev.rs"]
mod tests;
