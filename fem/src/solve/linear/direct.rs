//! Sparse symmetric factorisation by faer, one thread, as preconditioner of a Krylov method.
//!
//! The factor is L D Lᵀ without pivoting in single precision, which is half the memory and half
//! the time; conjugate gradients on the tangent in double precision make up for both the rounding
//! and the age of the factor. GMRES takes over where the tangent is not positive definite. A fresh
//! factor that is not good enough is made again in double precision, and then with Bunch–Kaufman
//! pivoting inside the supernodes.

use std::sync::Arc;

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

use super::krylov::{Stop, System, conjugate_gradients, gmres};
use super::vector::{Nodal, mask, weights};
use super::{LinearEffort, LinearSolver, Singular};
use crate::error::FemError;
use crate::material::Inverted;
use crate::operator::{Coupling, Graph, Increment, NONE, Operator, Pattern, Tangent, Unknowns};

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
                .map_err(|e| FemError::Factorisation { unknowns: n, reason: e.to_string() })?;
        Ok(Self { value_of, start, row, source, factor })
    }

    /// Entries of the factor.
    pub(crate) fn fill(&self) -> usize {
        self.factor.len_val()
    }

    fn size(&self) -> usize {
        self.value_of.len()
    }

    /// The matrix in the factor's precision; held unknowns are replaced by a unit equation.
    fn entries<T>(&self, tangent: &Tangent, free: &[[bool; 4]], from: fn(f64) -> T) -> Vec<T> {
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

    fn matrix<'a, T>(&'a self, entries: &'a [T]) -> SparseColMatRef<'a, u32, T> {
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
enum Factor {
    Absent,
    Single(Vec<f32>),
    Double(Vec<f64>),
    Pivoted { values: Vec<f64>, subdiagonal: Vec<f64>, forward: Vec<u32>, inverse: Vec<u32> },
}

/// The methods of factorisation, the cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Means {
    Single,
    Double,
    Pivoted,
}

/// Iterations after which an old factor is given up, and a fresh one judged not good enough.
const WORN: u32 = 12;
const POOR: u32 = 30;
/// Residual of a solution that is accepted although the tolerance was not reached.
const USELESS: f64 = 1e-3;

/// A tangent with a factor of it or of an earlier one.
pub(crate) struct Direct<'a> {
    operator: &'a dyn Operator,
    symbolic: Arc<Symbolic>,
    tangent: Tangent,
    free: Vec<[bool; 4]>,
    weight: Vec<Nodal>,
    coupling: Coupling,
    factor: Factor,
    means: Means,
    /// Whether the factor is that of the tangent.
    fresh: bool,
    /// Whether conjugate gradients have met no negative curvature of this tangent.
    definite: bool,
}

impl<'a> Direct<'a> {
    pub(crate) fn new(
        operator: &'a dyn Operator,
        pattern: Arc<Pattern>,
        symbolic: Arc<Symbolic>,
    ) -> Self {
        let nodes = pattern.graph.nodes();
        Self {
            operator,
            symbolic,
            tangent: Tangent::new(pattern),
            free: vec![[true; 4]; nodes],
            weight: vec![[0.0; 4]; nodes],
            coupling: Coupling::Full,
            factor: Factor::Absent,
            means: Means::Single,
            fresh: false,
            definite: true,
        }
    }

    fn factorise(&mut self) {
        let symbolic = &self.symbolic;
        if self.means == Means::Single {
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x as f32);
            let kept = match std::mem::replace(&mut self.factor, Factor::Absent) {
                Factor::Single(values) => values,
                _ => Vec::new(),
            };
            match ldlt(symbolic, &entries, kept) {
                Some(values) => self.factor = Factor::Single(values),
                None => self.means = Means::Double,
            }
        }
        if self.means == Means::Double {
            self.factor = Factor::Absent;
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x);
            match ldlt(symbolic, &entries, Vec::new()) {
                Some(values) => self.factor = Factor::Double(values),
                None => self.means = Means::Pivoted,
            }
        }
        if self.means == Means::Pivoted {
            self.factor = Factor::Absent;
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x);
            self.factor = with_pivots(symbolic, &entries);
        }
        self.fresh = true;
    }

    fn krylov(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
        limit: u32,
    ) -> (Stop, u32, f64) {
        let Self { symbolic, tangent, free, weight, factor, .. } = self;
        let mut apply = |x: &[Nodal], y: &mut [Nodal]| {
            tangent.multiply(x, y);
            mask(free, y);
        };
        let mut memory = solve_memory(symbolic, factor);
        // the factor may be that of a tangent with other values held
        let mut precondition = |x: &[Nodal], y: &mut [Nodal]| {
            apply_factor(symbolic, factor, &mut memory, x, y);
            mask(free, y);
        };
        let mut system = System { apply: &mut apply, precondition: &mut precondition, weight };
        let mut spent = 0;
        if self.definite && tangent.symmetric {
            let ending = conjugate_gradients(&mut system, right, step, tolerance, limit);
            if matches!(ending.stop, Stop::Converged | Stop::Limit) {
                return (ending.stop, ending.iterations, ending.residual);
            }
            self.definite = false;
            spent = ending.iterations;
        }
        let ending = gmres(&mut system, right, step, tolerance, limit);
        (ending.stop, spent + ending.iterations, ending.residual)
    }
}

impl LinearSolver for Direct<'_> {
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        self.operator.tangent(increment, coupling, &mut self.tangent)?;
        if coupling != self.coupling {
            self.factor = Factor::Absent;
            self.coupling = coupling;
        }
        self.free.copy_from_slice(free);
        self.weight = weights(&self.tangent.diagonal(), free);
        self.fresh = false;
        self.definite = true;
        self.means = Means::Single;
        Ok(())
    }

    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular> {
        let mut masked = right.to_vec();
        mask(&self.free, &mut masked);
        let mut effort = LinearEffort::default();
        if !matches!(self.factor, Factor::Absent) {
            let limit = if self.fresh { POOR } else { WORN };
            let (stop, iterations, residual) = self.krylov(&masked, step, tolerance, limit);
            effort.iterations += iterations;
            effort.residual = residual;
            if stop == Stop::Converged {
                return Ok(effort);
            }
            if self.fresh {
                // a right-hand side may need more than the one before
                self.means = self.means.max(Means::Double);
            }
            self.definite = true;
        }
        loop {
            self.factorise();
            effort.renewals += 1;
            let (stop, iterations, residual) = self.krylov(&masked, step, tolerance, POOR);
            effort.iterations += iterations;
            effort.residual = residual;
            let accepted = self.means == Means::Pivoted && residual <= USELESS;
            if stop == Stop::Converged || accepted {
                return Ok(effort);
            }
            self.means = match self.means {
                Means::Single => Means::Double,
                Means::Double => Means::Pivoted,
                Means::Pivoted => return Err(Singular),
            };
            self.definite = true;
        }
    }
}

/// L D Lᵀ without pivots, into memory that is used again; `None` at a zero pivot.
fn ldlt<T: ComplexField + Default>(
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

fn with_pivots(symbolic: &Symbolic, entries: &[f64]) -> Factor {
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

fn solve_memory(symbolic: &Symbolic, factor: &Factor) -> MemBuffer {
    let structure = &symbolic.factor;
    MemBuffer::new(match factor {
        Factor::Single(_) => structure.solve_in_place_scratch::<f32>(1, Par::Seq),
        _ => structure.solve_in_place_scratch::<f64>(1, Par::Seq),
    })
}

/// y = M⁻¹ x for nodal vectors.
fn apply_factor(
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
