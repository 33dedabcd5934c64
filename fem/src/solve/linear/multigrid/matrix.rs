//! Matrices of multigrid levels, in any memory.

use super::super::vectors::Vectors;

/// Square matrix A of one level, with D: its diagonal or its diagonal blocks.
pub(crate) trait Matrix {
    /// Vectors of the level.
    type Space: Vectors;

    /// y ← y − A x.
    fn subtract(&mut self, x: &Vector<Self>, y: &mut Vector<Self>);

    /// step ← momentum step + weight D⁻¹ r, then x ← x + step. The old `step` is not read if momentum is zero.
    fn relax(
        &self,
        coefficients: Relaxation,
        r: &Vector<Self>,
        step: &mut Vector<Self>,
        x: &mut Vector<Self>,
    );
}

/// Level with a matrix and a prolongation P from the next coarser level.
pub(crate) trait Grid {
    /// Matrix of the level.
    type Matrix: Matrix;
    /// Vectors of the coarser level.
    type Coarse: Vectors;

    fn matrix(&mut self) -> &mut Self::Matrix;

    /// b ← Pᵀ r.
    fn restrict(&mut self, r: &Vector<Self::Matrix>, b: &mut CoarseVector<Self>);

    /// x ← x + P c.
    fn add_prolonged(&mut self, c: &CoarseVector<Self>, x: &mut Vector<Self::Matrix>);
}

/// Vector of the level of a matrix.
pub(crate) type Vector<M> = <<M as Matrix>::Space as Vectors>::Vector;
/// Vectors of the level of a grid.
pub(crate) type Space<G> = <<G as Grid>::Matrix as Matrix>::Space;
/// Vector of the level below a grid.
pub(crate) type CoarseVector<G> = <<G as Grid>::Coarse as Vectors>::Vector;

/// Coefficients of one smoothing step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Relaxation {
    pub(crate) momentum: f64,
    pub(crate) weight: f64,
}

/// Approximate inverse of the matrix of a level.
pub(crate) trait Preconditioner {
    /// Vectors of the level.
    type Space: Vectors;

    /// x ≈ A⁻¹ b. The old x is not read; b may be overwritten.
    fn apply(
        &mut self,
        b: &mut <Self::Space as Vectors>::Vector,
        x: &mut <Self::Space as Vectors>::Vector,
    );
}

/// Approximate inverse of a matrix on nodal vectors, or of its blocks of some fields.
pub(crate) trait NodalPreconditioner<S: Vectors> {
    /// z ≈ A⁻¹ r in the fields of this block; later fields of z are set to zero. The old z is not read.
    fn apply(&mut self, r: &S::Vector, z: &mut S::Vector);
}
