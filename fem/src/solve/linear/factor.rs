//! The structure of the matrix, and its factor with and without pivots.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LdltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::ComplexField;
use faer::{Conj, MatMut, Par, Side};

use super::vector::Nodal;
use crate::error::FemError;
use crate::operator::{Graph, NONE, Tangent, Unknowns};

/// The structure of matrix and factor: shared by all steps and all runs on a discretisation.
#[derive(Debug)]
pub(crate) struct Symbolic {
    /// (node, component) of each equation.
    value_of: Vec<(u32, u32)>,
    /// The lower triangle, column by column.
    start: Vec<u32>,
    row: Vec<u32>,
    /// Where the entries are in the blocks of the tangent, as 16 × block + 4 × i + j.
    source: Vec<u32>,
    factor: SymbolicCholesky<u32>,
}

impl Symbolic {
    /// The structure for unknowns that are numbered in a fill-reducing order.
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
            for (i, &near) in graph.of(node as usize).iter().enumerate() {
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
        let (upper_start, upper_row) = upper_triangle(&start, &row);
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &upper_start, None, &upper_row);
        // supernodes even where they do not pay, since only they can be factorised with pivots
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let factor =
            factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
                .map_err(|e| FemError::factorisation(n, e))?;
        Ok(Self { value_of, start, row, source, factor })
    }

    /// Entries of the factor.
    pub(crate) fn fill(&self) -> usize {
        self.factor.len_val()
    }

    pub(super) fn size(&self) -> usize {
        self.value_of.len()
    }

    /// The matrix in the factor's precision; constrained unknowns are replaced by a unit equation.
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
            for place in self.start[column] as usize..self.start[column + 1] as usize {
                let row = self.row[place] as usize;
                out.push(from(if column_free && is_free(row) {
                    values[self.source[place] as usize]
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

/// The transpose of a lower triangle: columns of the upper triangle.
fn upper_triangle(start: &[u32], row: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let n = start.len() - 1;
    let mut upper = vec![0u32; n + 1];
    for &r in row {
        upper[r as usize + 1] += 1;
    }
    for i in 0..n {
        upper[i + 1] += upper[i];
    }
    let mut next = upper.clone();
    let mut column_of = vec![0u32; row.len()];
    for column in 0..n {
        for &r in &row[start[column] as usize..start[column + 1] as usize] {
            column_of[next[r as usize] as usize] = column as u32;
            next[r as usize] += 1;
        }
    }
    (upper, column_of)
}

/// A factor, by how it was made.
pub(super) enum Factor {
    Absent,
    Single(Vec<f32>),
    Double(Vec<f64>),
    Pivoted { values: Vec<f64>, subdiagonal: Vec<f64>, forward: Vec<u32>, inverse: Vec<u32> },
}

/// L D Lᵀ without pivots, into memory that is used again; `None` at a zero pivot.
pub(super) fn ldlt<T: ComplexField + Default>(
    symbolic: &Symbolic,
    entries: &[T],
    mut values: Vec<T>,
) -> Option<Vec<T>> {
    let factor = &symbolic.factor;
    values.resize_with(factor.len_val(), T::default);
    let scratch = factor.factorize_numeric_ldlt_scratch::<T>(Par::Seq, Default::default());
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    let stack = MemStack::new(&mut memory);
    let done = factor.factorize_numeric_ldlt(
        &mut values,
        symbolic.matrix(entries),
        Side::Lower,
        Default::default(),
        Par::Seq,
        stack,
        Default::default(),
    );
    done.is_ok().then_some(values)
}

pub(super) fn with_pivots(symbolic: &Symbolic, entries: &[f64]) -> Factor {
    let (n, factor) = (symbolic.size(), &symbolic.factor);
    let mut values = vec![0.0; factor.len_val()];
    let (mut subdiagonal, mut forward, mut inverse) = (vec![0.0; n], vec![0; n], vec![0; n]);
    let scratch =
        factor.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default());
    let mut memory = MemBuffer::new(scratch);
    factor.factorize_numeric_intranode_lblt(
        &mut values,
        &mut subdiagonal,
        &mut forward,
        &mut inverse,
        symbolic.matrix(entries),
        Side::Lower,
        Par::Seq,
        MemStack::new(&mut memory),
        Default::default(),
    );
    Factor::Pivoted { values, subdiagonal, forward, inverse }
}

pub(super) fn solve_memory(symbolic: &Symbolic, factor: &Factor) -> MemBuffer {
    let structure = &symbolic.factor;
    MemBuffer::new(match factor {
        Factor::Single(_) => structure.solve_in_place_scratch::<f32>(1, Par::Seq),
        _ => structure.solve_in_place_scratch::<f64>(1, Par::Seq),
    })
}

/// y = M⁻¹ x for nodal vectors.
pub(super) fn apply_factor(
    symbolic: &Symbolic,
    factor: &Factor,
    memory: &mut MemBuffer,
    x: &[Nodal],
    y: &mut [Nodal],
) {
    let n = symbolic.size();
    let places = || symbolic.value_of.iter().map(|&(node, k)| (node as usize, k as usize));
    let stack = MemStack::new(memory);
    y.fill([0.0; 4]);
    if let Factor::Single(values) = factor {
        // the factor is linear: a right-hand side of size one stays clear of overflow
        let size = x.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
        let scale = if size > 0.0 { 1.0 / size } else { 1.0 };
        let mut work: Vec<f32> = places().map(|(node, k)| (scale * x[node][k]) as f32).collect();
        let right = MatMut::from_column_major_slice_mut(&mut work, n, 1);
        let factor = LdltRef::new(&symbolic.factor, values);
        factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
        places().zip(&work).for_each(|((node, k), &v)| y[node][k] = f64::from(v) / scale);
        return;
    }
    let mut work: Vec<f64> = places().map(|(node, k)| x[node][k]).collect();
    let right = MatMut::from_column_major_slice_mut(&mut work, n, 1);
    match factor {
        Factor::Double(values) => LdltRef::new(&symbolic.factor, values).solve_in_place_with_conj(
            Conj::No,
            right,
            Par::Seq,
            stack,
        ),
        Factor::Pivoted { values, subdiagonal, forward, inverse } => {
            let pivots = PermRef::new_checked(forward, inverse, n);
            IntranodeLbltRef::new(&symbolic.factor, values, subdiagonal, pivots)
                .solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
        }
        Factor::Absent | Factor::Single(_) => {}
    }
    places().zip(&work).for_each(|((node, k), &v)| y[node][k] = v);
}
