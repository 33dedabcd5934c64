//! Multigrid V-cycles, for vectors in the memory of this process or of a device.

use std::borrow::{Borrow, BorrowMut};

use super::super::krylov::Preconditioned;
use super::super::vectors::{KrylovVectors, Vectors};
use super::chebyshev::Smoother;
use super::matrix::{
    CoarseVector, Grid, Matrix, NodalPreconditioner, Preconditioner, Space, Vector,
};

/// Smoother and work vectors of one level.
#[derive(Debug)]
pub(crate) struct Level<S: Vectors, C: Vectors> {
    vectors: S,
    pub(crate) smoother: Smoother<S>,
    residual: S::Owned,
    /// Work vector: right-hand side on the next coarser level.
    right: C::Owned,
    /// Work vector: solution on the next coarser level.
    correction: C::Owned,
}

impl<S: Vectors, C: Vectors> Level<S, C> {
    /// Creates a level; `residual` is a work vector of this level, `right` a work vector of the next coarser level.
    pub(crate) fn new(
        vectors: S,
        coarse: &C,
        smoother: Smoother<S>,
        residual: S::Owned,
        right: C::Owned,
    ) -> Self {
        let correction = coarse.zero(right.borrow());
        Self { vectors, smoother, residual, right, correction }
    }

    /// Computes x ≈ A⁻¹ b in three stages: smoothing, correction by the coarser level, smoothing. `below(b, x)` solves
    /// on the coarser level, and may overwrite its argument b.
    pub(crate) fn cycle<G: Grid<Matrix: Matrix<Space = S>, Coarse = C>>(
        &mut self,
        grid: &mut G,
        b: &S::Vector,
        x: &mut S::Vector,
        below: impl FnOnce(&mut CoarseVector<G>, &mut CoarseVector<G>),
    ) {
        let Self { vectors, smoother, .. } = self;
        let residual = self.residual.borrow_mut();
        let (right, correction) = (self.right.borrow_mut(), self.correction.borrow_mut());
        vectors.clear(x);
        vectors.copy(b, residual);
        smoother.smooth(grid.matrix(), residual, x);
        vectors.copy(b, residual);
        grid.matrix().subtract(x, residual);
        grid.restrict(residual, right);
        below(right, correction);
        grid.add_prolonged(correction, x);
        vectors.copy(b, residual);
        grid.matrix().subtract(x, residual);
        smoother.smooth(grid.matrix(), residual, x);
    }
}

/// One level of an algebraic hierarchy: its matrix with the transfer to the next coarser level, and its smoother.
#[derive(Debug)]
pub(crate) struct AmgLevel<G: Grid> {
    pub(crate) grid: G,
    pub(crate) level: Level<Space<G>, G::Coarse>,
}

/// Hierarchy of the displacement: finest level, coarser levels, and the solver of the coarsest level.
#[derive(Debug)]
pub(crate) struct Amg<F: Grid, C: Grid, L> {
    pub(crate) fine: AmgLevel<F>,
    pub(crate) coarse: Vec<AmgLevel<C>>,
    pub(crate) last: L,
}

impl<V, F, C, L> Preconditioner for Amg<F, C, L>
where
    V: Vectors,
    F: Grid<Coarse = V>,
    C: Grid<Matrix: Matrix<Space = V>, Coarse = V>,
    L: Preconditioner<Space = V>,
{
    type Space = Space<F>;

    fn apply(&mut self, b: &mut Vector<F::Matrix>, x: &mut Vector<F::Matrix>) {
        let Self { fine: AmgLevel { grid, level }, coarse, last } = self;
        level.cycle(grid, b, x, |b, x| coarser(coarse, last, b, x));
    }
}

fn coarser<V: Vectors, C, L>(
    levels: &mut [AmgLevel<C>],
    last: &mut L,
    b: &mut V::Vector,
    x: &mut V::Vector,
) where
    C: Grid<Matrix: Matrix<Space = V>, Coarse = V>,
    L: Preconditioner<Space = V>,
{
    match levels.split_first_mut() {
        Some((AmgLevel { grid, level }, levels)) => {
            level.cycle(grid, b, x, |b, x| coarser(levels, last, b, x));
        }
        None => last.apply(b, x),
    }
}

/// Preconditioner of the tangent, which consists of the level of quadratic elements (if the elements are quadratic) and
/// of the preconditioner `below` on the vertices.
#[derive(Debug)]
pub(crate) struct Multigrid<S: Vectors, P> {
    pub(crate) quadratic: Option<Level<S, S>>,
    pub(crate) below: P,
}

/// Matrix-free tangent A in which the rows and columns of the constrained values are zero.
pub(crate) trait FreeTangent:
    Matrix + Grid<Matrix = Self, Coarse = <Self as Matrix>::Space>
{
    /// y = A x.
    fn multiply(&mut self, x: &Vector<Self>, y: &mut Vector<Self>);

    /// Sets the constrained values of x to zero.
    fn mask(&self, x: &mut Vector<Self>);
}

/// Matrix-free tangent with its preconditioner.
pub(crate) struct MatrixFree<'a, T: FreeTangent, P> {
    pub(crate) tangent: &'a mut T,
    pub(crate) multigrid: &'a mut Multigrid<T::Space, P>,
}

impl<T, P> Preconditioned<T::Space> for MatrixFree<'_, T, P>
where
    T: FreeTangent<Space: KrylovVectors>,
    P: NodalPreconditioner<T::Space>,
{
    fn apply(&mut self, x: &Vector<T>, y: &mut Vector<T>) {
        self.tangent.multiply(x, y);
    }

    fn precondition(&mut self, r: &Vector<T>, z: &mut Vector<T>) {
        let Multigrid { quadratic, below } = self.multigrid;
        match quadratic {
            Some(level) => level.cycle(self.tangent, r, z, |r, z| below.apply(r, z)),
            None => below.apply(r, z),
        }
        self.tangent.mask(z);
    }
}
