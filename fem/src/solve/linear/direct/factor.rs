//! Sparsity structure of the matrix and of its factor, and the factor with and without pivoting.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LdltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::super::in_memory::Nodal;
use crate::error::FemError;
use crate::operator::{Graph, NONE, Tangent, Unknowns};

/// Sparsity structure of the matrix and of its factor, shared by all steps and all runs on a discretisation.
#[derive(Debug)]
pub(crate) struct Symbolic {
    /// (node, component) of each equation; the components 0 to 3 are u_x, u_y, u_z, φ.
    value_of: Vec<(u32, u32)>,
    /// Offsets of the columns in `row` and `source`; length: number of equations + 1.
    start: Vec<u32>,
    /// Row indices of the entries of the lower triangle, column by column.
    row: Vec<u32>,
    /// Position of each entry in the tangent: 16 × block + 4 × i + j for entry (i, j) of a 4 × 4 block.
    source: Vec<u32>,
    /// Structure of the factor.
    factor: SymbolicCholesky<u32>,
}

impl Symbolic {
    /// Computes the sparsity structure. The unknowns must be numbered in a fill-reducing order.
    pub(crate) fn new(graph: &Graph, unknowns: &Unknowns) -> Result<Self, FemError> {
        let n = unknowns.count;
        let mut value_of = vec![(0, 0); n];
        for (node, equations) in unknowns.equation.iter().enumerate() {
            for (k, &e) in equations.iter().enumerate().filter(|(_, e)| **e != NONE) {
                value_of[e as usize] = (node as u32, k as u32);
            }
        }
        let mut start = vec![0u32];
        let (mut row, mut source) = (Vec::new(), Vec::new());
        let mut column: Vec<(u32, u32)> = Vec::new();
        for (equation, &(node, k)) in value_of.iter().enumerate() {
            column.clear();
            let first = graph.start[node as usize];
            for (i, &near) in graph.neighbours(node as usize).iter().enumerate() {
                for (l, &e) in unknowns.equation[near as usize].iter().enumerate() {
                    if e != NONE && e as usize >= equation {
                        column.push((e, 16 * (first + i as u32) + 4 * k + l as u32));
                    }
                }
            }
            column.sort_unstable();
            row.extend(column.iter().map(|c| c.0));
            source.extend(column.iter().map(|c| c.1));
            start.push(row.len() as u32);
        }
        let failed = |error| FemError::factorisation(n, error);
        let lower = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &row);
        let upper = lower.transpose().to_col_major().map_err(failed)?;
        // always use supernodal factors, even where simplicial factors are faster, because only supernodal factors
        // support pivoting
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let factor = factorize_symbolic_cholesky(
            upper.as_ref(),
            Side::Upper,
            SymmetricOrdering::Identity,
            params,
        )
        .map_err(failed)?;
        Ok(Self { value_of, start, row, source, factor })
    }

    /// Returns the number of entries of the factor.
    pub(crate) fn fill(&self) -> usize {
        self.factor.len_val()
    }

    pub(super) fn size(&self) -> usize {
        self.value_of.len()
    }

    /// Returns the entries of the matrix, converted to the type `T` by `from`. Constrained unknowns get a unit row and
    /// column.
    pub(super) fn entries<T>(
        &self,
        tangent: &Tangent,
        free: &[[bool; 4]],
        from: fn(f64) -> T,
    ) -> Vec<T> {
        let values = tangent.blocks.as_flattened().as_flattened();
        let is_free = |e: usize| {
            let (node, k) = self.value_of[e];
            free[node as usize][k as usize]
        };
        let mut out = Vec::with_capacity(self.row.len());
        for column in 0..self.size() {
            let column_free = is_free(column);
            for entry in self.start[column] as usize..self.start[column + 1] as usize {
                let row = self.row[entry] as usize;
                out.push(from(if column_free && is_free(row) {
                    values[self.source[entry] as usize]
                } else {
                    f64::from(row == column)
                }));
            }
        }
        out
    }

    pub(super) fn matrix<'a, T>(&'a self, entries: &'a [T]) -> SparseColMatRef<'a, u32, T> {
        let n = self.size();
        let lower = SymbolicSparseColMatRef::new_checked(n, n, &self.start, None, &self.row);
        SparseColMatRef::new(lower, entries)
    }
}

/// Factor of the matrix.
pub(super) enum Factor {
    /// No factor has been computed, or the factorisation failed.
    Absent,
    /// Factor L D Lᵀ without pivoting, in single precision.
    Single(Vec<f32>),
    /// Factor L B Lᵀ with Bunch–Kaufman pivoting inside the supernodes, in double precision.
    Pivoted { values: Vec<f64>, subdiagonal: Vec<f64>, forward: Vec<u32>, inverse: Vec<u32> },
}

impl Factor {
    /// Factorises without pivoting, in the memory of the earlier factor `self`. Returns [`Absent`](Self::Absent) if a
    /// pivot is zero.
    pub(super) fn single(self, symbolic: &Symbolic, tangent: &Tangent, free: &[[bool; 4]]) -> Self {
        let mut values = if let Factor::Single(values) = self { values } else { Vec::new() };
        let (factor, entries) = (&symbolic.factor, symbolic.entries(tangent, free, |x| x as f32));
        values.resize(factor.len_val(), 0.0);
        let scratch = factor.factorize_numeric_ldlt_scratch::<f32>(Par::Seq, Default::default());
        let Ok(mut memory) = MemBuffer::try_new(scratch) else { return Factor::Absent };
        let done = factor.factorize_numeric_ldlt(
            &mut values,
            symbolic.matrix(&entries),
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        );
        if done.is_ok() { Factor::Single(values) } else { Factor::Absent }
    }

    /// Factorises with pivoting.
    pub(super) fn pivoted(symbolic: &Symbolic, tangent: &Tangent, free: &[[bool; 4]]) -> Self {
        let (n, factor) = (symbolic.size(), &symbolic.factor);
        let entries = symbolic.entries(tangent, free, |x| x);
        let mut values = vec![0.0; factor.len_val()];
        let (mut subdiagonal, mut forward, mut inverse) = (vec![0.0; n], vec![0; n], vec![0; n]);
        let scratch =
            factor.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default());
        factor.factorize_numeric_intranode_lblt(
            &mut values,
            &mut subdiagonal,
            &mut forward,
            &mut inverse,
            symbolic.matrix(&entries),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        );
        Factor::Pivoted { values, subdiagonal, forward, inverse }
    }

    /// Allocates the work memory of [`apply`](Self::apply) for the given number of vectors.
    pub(super) fn memory(&self, symbolic: &Symbolic, vectors: usize) -> MemBuffer {
        let structure = &symbolic.factor;
        MemBuffer::new(match self {
            Factor::Single(_) => structure.solve_in_place_scratch::<f32>(vectors, Par::Seq),
            _ => structure.solve_in_place_scratch::<f64>(vectors, Par::Seq),
        })
    }

    /// Computes y = M⁻¹ x for several nodal vectors x, where M is the factorised matrix. The vectors are processed
    /// together, so that the factor is read from memory only once.
    pub(super) fn apply(
        &self,
        symbolic: &Symbolic,
        memory: &mut MemBuffer,
        x: &[&[Nodal]],
        y: &mut [&mut [Nodal]],
    ) {
        let n = symbolic.size();
        let values_of_equations =
            || symbolic.value_of.iter().map(|&(node, k)| (node as usize, k as usize));
        let stack = MemStack::new(memory);
        y.iter_mut().for_each(|y| y.fill([0.0; 4]));
        match self {
            Factor::Absent => {}
            Factor::Single(values) => {
                // scale the right-hand side to largest entry 1 to avoid overflow in single precision
                let scale = |x: &&[Nodal]| {
                    let size = x.as_flattened().iter().fold(0.0f64, |m, v| m.max(v.abs()));
                    if size > 0.0 { 1.0 / size } else { 1.0 }
                };
                let scales: Vec<f64> = x.iter().map(scale).collect();
                let mut work = Vec::with_capacity(n * x.len());
                for (x, scale) in x.iter().zip(&scales) {
                    work.extend(values_of_equations().map(|(node, k)| (scale * x[node][k]) as f32));
                }
                let right = MatMut::from_column_major_slice_mut(&mut work, n, x.len());
                let factor = LdltRef::new(&symbolic.factor, values);
                factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
                for ((y, work), scale) in y.iter_mut().zip(work.chunks_exact(n)).zip(scales) {
                    values_of_equations()
                        .zip(work)
                        .for_each(|((node, k), &v)| y[node][k] = f64::from(v) / scale);
                }
            }
            Factor::Pivoted { values, subdiagonal, forward, inverse } => {
                let mut work = Vec::with_capacity(n * x.len());
                for x in x {
                    work.extend(values_of_equations().map(|(node, k)| x[node][k]));
                }
                let right = MatMut::from_column_major_slice_mut(&mut work, n, x.len());
                let pivots = PermRef::new_checked(forward, inverse, n);
                let factor = IntranodeLbltRef::new(&symbolic.factor, values, subdiagonal, pivots);
                factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
                for (y, work) in y.iter_mut().zip(work.chunks_exact(n)) {
                    values_of_equations().zip(work).for_each(|((node, k), &v)| y[node][k] = v);
                }
            }
        }
    }
}
