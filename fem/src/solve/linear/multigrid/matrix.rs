//! Matrices and transfers of multigrid levels, for vectors in the memory of this process or of a device.

use super::super::vectors::Vectors;

/// Square matrix A of one level. D denotes the diagonal of A, or the diagonal blocks of A.
pub(crate) trait Matrix {
    /// Vectors of the level.
    type Space: Vectors;

    /// y ← y − A x.
    fn subtract(&mut self, x: &Vector<Self>, y: &mut Vector<Self>);

    /// Smoothing step: step ← momentum · step + weight · D⁻¹ r, then x ← x + step. The old `step` is not read if
    /// momentum is zero.
    fn relax(
        &self,
        coefficients: Relaxation,
        r: &Vector<Self>,
        step: &mut Vector<Self>,
        x: &mut Vector<Self>,
    );
}

/// Level of a hierarchy, with a matrix and the prolongation P from the next coarser level.
pub(crate) trait Grid {
    /// Matrix of the level.
    type Matrix: Matrix;
    /// Vector operations on the next coarser level.
    type Coarse: Vectors;

    fn matrix(&mut self) -> &mut Self::Matrix;

    /// b ← Pᵀ r.
    fn restrict(&mut self, r: &Vector<Self::Matrix>, b: &mut CoarseVector<Self>);

    /// x ← x + P c.
    fn add_prolonged(&mut self, c: &CoarseVector<Self>, x: &mut Vector<Self::Matrix>);
}

/// Type of the vectors that a matrix multiplies.
pub(crate) type Vector<M> = <<M as Matrix>::Space as Vectors>::Vector;
/// Type of the vector operations on the level of a grid.
pub(crate) type Space<G> = <<G as Grid>::Matrix as Matrix>::Space;
/// Type of the vectors on the next coarser level of a grid.
pub(crate) type CoarseVector<G> = <<G as Grid>::Coarse as Vectors>::Vector;

/// Coefficients of one smoothing step, see [`Matrix::relax`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaxation {
    pub(crate) momentum: f64,
    pub(crate) weight: f64,
}

/// Approximate inverse of the matrix A of a level.
pub(crate) trait Preconditioner {
    /// Vectors of the level.
    type Space: Vectors;

    /// Computes x ≈ A⁻¹ b. The old x is not read; b may be overwritten.
    fn apply(
        &mut self,
        b: &mut <Self::Space as Vectors>::Vector,
        x: &mut <Self::Space as Vectors>::Vector,
    );
}

/// Approximate inverse of a matrix on nodal vectors, or of the block of this matrix for selected components.
pub(crate) trait NodalPreconditioner<S: Vectors> {
    /// Computes z ≈ A⁻¹ r in the selected components; later components of z are set to zero. The old z is not read.
    fn apply(&mut self, r: &S::Vector, z: &mut S::Vector);
}
