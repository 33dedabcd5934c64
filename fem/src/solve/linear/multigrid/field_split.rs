//! Block preconditioner of displacement and damage: multigrid for the displacement, and Chebyshev steps for the damage,
//! whose block is dominated by a mass matrix. The preconditioner is positive definite if both blocks are positive
//! definite.

use std::borrow::BorrowMut;
use std::sync::Arc;

use rayon::prelude::*;

use super::super::in_memory::{CHUNK, InMemory, Nodal, NodalVectors, largest};
use super::super::vectors::Vectors;
use super::amg::{AmgInMemory, amg};
use super::assembled::{Assembled, diagonal_blocks};
use super::block_csr::BlockCsr;
use super::chebyshev::{Smoother, Smoothing};
use super::matrix::{NodalPreconditioner, Preconditioner};
use crate::operator::Tangent;
use crate::parallel::Halo;

/// Degree of the Chebyshev polynomial that preconditions the damage block.
const DEGREE: usize = 4;

/// Preconditioners of the displacement block and of the damage block.
#[derive(Debug)]
pub(crate) struct FieldSplit<U, D> {
    pub(crate) displacement: U,
    /// Preconditioner of the damage block; `None` if no damage value is free.
    pub(crate) damage: Option<D>,
}

impl<S: Vectors, U: NodalPreconditioner<S>, D: NodalPreconditioner<S>> NodalPreconditioner<S>
    for FieldSplit<U, D>
{
    fn apply(&mut self, r: &S::Vector, z: &mut S::Vector) {
        self.displacement.apply(r, z);
        if let Some(damage) = &mut self.damage {
            damage.apply(r, z);
        }
    }
}

/// Conversion between nodal vectors and single-precision vectors of selected consecutive components.
pub(crate) trait Fields {
    /// Type of the vectors of all components u_x, u_y, u_z, φ.
    type Nodal: Vectors;
    /// Type of the single-precision vectors of the selected components.
    type Space: Vectors;

    /// Copies the selected components of `r`, divided by their largest absolute value, to `out`. The divisor (*scale*)
    /// is stored; it is 1 if all values are zero.
    fn narrow(
        &mut self,
        r: &<Self::Nodal as Vectors>::Vector,
        out: &mut <Self::Space as Vectors>::Vector,
    );

    /// Writes x times the stored scale to the selected components of z, and zero to all later components.
    fn widen(&self, x: &<Self::Space as Vectors>::Vector, z: &mut <Self::Nodal as Vectors>::Vector);
}

/// Preconditioner of the block of the tangent that belongs to selected components, with conversion to single precision.
#[derive(Debug)]
pub(crate) struct Block<F: Fields, P> {
    fields: F,
    pub(crate) inverse: P,
    /// Work vector for the right-hand side.
    right: <F::Space as Vectors>::Owned,
    /// Work vector for the solution.
    solution: <F::Space as Vectors>::Owned,
}

impl<F: Fields, P> Block<F, P> {
    /// Creates the preconditioner; `work` contains two work vectors of the selected components.
    pub(crate) fn new(fields: F, inverse: P, work: [<F::Space as Vectors>::Owned; 2]) -> Self {
        let [right, solution] = work;
        Self { fields, inverse, right, solution }
    }
}

impl<F: Fields, P: Preconditioner<Space = F::Space>> NodalPreconditioner<F::Nodal> for Block<F, P> {
    fn apply(&mut self, r: &<F::Nodal as Vectors>::Vector, z: &mut <F::Nodal as Vectors>::Vector) {
        let (right, solution) = (self.right.borrow_mut(), self.solution.borrow_mut());
        self.fields.narrow(r, right);
        self.inverse.apply(right, solution);
        self.fields.widen(solution, z);
    }
}

/// Selection of `R` of the four components u_x, u_y, u_z, φ, beginning with component `first`, for vectors in main
/// memory (not on a device).
#[derive(Debug)]
pub(crate) struct FieldsInMemory<const R: usize> {
    first: usize,
    scale: f64,
    halo: Arc<Halo>,
}

impl<const R: usize> Fields for FieldsInMemory<R> {
    type Nodal = NodalVectors;
    type Space = InMemory<f32, R>;

    fn narrow(&mut self, r: &[Nodal], out: &mut [[f32; R]]) {
        let fields = self.first..self.first + R;
        let mut most = [largest(r, |r| r[fields.clone()].iter().fold(0.0, |m, v| m.max(v.abs())))];
        self.halo.ranks().max(&mut most);
        self.scale = if most[0] > 0.0 { most[0] } else { 1.0 };
        let (first, scale) = (self.first, self.scale);
        out.par_iter_mut().with_min_len(CHUNK).zip(r).for_each(|(out, r)| {
            *out = std::array::from_fn(|k| (r[first + k] / scale) as f32);
        });
    }

    fn widen(&self, x: &[[f32; R]], z: &mut [Nodal]) {
        z.par_iter_mut().with_min_len(CHUNK).zip(x).for_each(|(z, x)| {
            let (fields, later) = z[self.first..].split_at_mut(R);
            fields.iter_mut().zip(x).for_each(|(z, x)| *z = self.scale * f64::from(*x));
            later.fill(0.0);
        });
    }
}

/// Preconditioner on the vertices in the memory of this process.
pub(crate) type FieldSplitInMemory = FieldSplit<
    Block<FieldsInMemory<3>, AmgInMemory>,
    Block<FieldsInMemory<1>, Smoothing<Assembled<1>>>,
>;

impl FieldSplitInMemory {
    /// Creates the preconditioner from this rank's contribution to the tangent of the linear shape functions.
    pub(crate) fn new(
        tangent: &Tangent,
        positions: &[[f64; 3]],
        free: &[[bool; 4]],
        halo: &Arc<Halo>,
    ) -> Self {
        let displacement = amg(&fields::<3>(tangent, free, 0, halo), positions, free, halo);
        let has_damage = halo.ranks().any(free.iter().any(|f| f[3]));
        let damage = has_damage.then(|| {
            let block = fields::<1>(tangent, free, 3, halo);
            let mut matrix = Assembled::new(&block, &diagonal_blocks(&block, halo), halo);
            let (vectors, like) = (InMemory::new(halo), vec![[0.0]; free.len()]);
            let smoother = Smoother::measured(&vectors, &mut matrix, DEGREE, &like);
            in_fields(3, halo, Smoothing { vectors, matrix, smoother }, free.len())
        });
        Self { displacement: in_fields(0, halo, displacement, free.len()), damage }
    }
}

fn in_fields<const R: usize, P>(
    first: usize,
    halo: &Arc<Halo>,
    inverse: P,
    nodes: usize,
) -> Block<FieldsInMemory<R>, P> {
    let fields = FieldsInMemory { first, scale: 1.0, halo: Arc::clone(halo) };
    Block::new(fields, inverse, [(); 2].map(|()| vec![[0.0; R]; nodes]))
}

/// Returns the block of the tangent for the components `first` to `first + R − 1`. A constrained value gets a unit row
/// and column on the rank that owns its node, and zeros on all other ranks.
fn fields<const R: usize>(
    tangent: &Tangent,
    free: &[[bool; 4]],
    first: usize,
    halo: &Halo,
) -> BlockCsr<f64, R, R> {
    let graph = &tangent.pattern.graph;
    let entry = |row: usize, column: u32, entries: &[[f64; 4]; 4]| -> [[f64; R]; R] {
        let (free_in_row, free_in_column) = (&free[row], &free[column as usize]);
        let unit = row == column as usize && halo.owns(column);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if free_in_row[first + i] && free_in_column[first + j] {
                    entries[first + i][first + j]
                } else {
                    f64::from(unit && i == j)
                }
            })
        })
    };
    let mut block = vec![[[0.0; R]; R]; tangent.blocks.len()];
    let mut rows = Vec::with_capacity(free.len());
    let mut rest = block.as_mut_slice();
    for row in 0..free.len() {
        let (in_row, next) = rest.split_at_mut(graph.neighbours(row).len());
        rows.push(in_row);
        rest = next;
    }
    rows.into_par_iter().with_min_len(CHUNK).enumerate().for_each(|(row, blocks)| {
        let entries = &tangent.blocks[graph.start[row] as usize..];
        for ((block, entries), &column) in blocks.iter_mut().zip(entries).zip(graph.neighbours(row))
        {
            *block = entry(row, column, entries);
        }
    });
    BlockCsr {
        columns: graph.nodes(),
        start: graph.start.clone(),
        column: graph.near.clone(),
        block,
    }
}
