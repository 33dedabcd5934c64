//! Sparse symmetric indefinite factorisation by faer, one thread.
//!
//! The tangent is symmetric, and indefinite past the peak. L D Lᵀ without pivoting is tried first;
//! iterative refinement measures whether it was good enough, and if not, the factorisation is done
//! again with Bunch–Kaufman pivoting inside the supernodes.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LdltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::error::FemError;
use crate::operator::Pattern;

/// The structure of matrix and factor: shared by all steps and all runs on a discretisation.
#[derive(Debug)]
pub(crate) struct Symbolic {
    pub(crate) pattern: Pattern,
    factor: SymbolicCholesky<usize>,
}

impl Symbolic {
    pub(crate) fn new(pattern: Pattern) -> Result<Self, FemError> {
        let (start, row) = upper_triangle(&pattern);
        let n = pattern.size;
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &start, None, &row);
        // the unknowns are numbered in a fill-reducing order already; supernodes even where they
        // do not pay, since only they can be factorised with pivots
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let factor =
            factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
                .map_err(|e| FemError::Factorisation { unknowns: n, reason: e.to_string() })?;
        Ok(Self { pattern, factor })
    }

    /// Entries of the factor.
    pub(crate) fn fill(&self) -> usize {
        self.factor.len_val()
    }

    fn lower(&self) -> SymbolicSparseColMatRef<'_, usize> {
        let p = &self.pattern;
        SymbolicSparseColMatRef::new_checked(p.size, p.size, &p.column_start, None, &p.row)
    }
}

/// The transpose of the pattern: columns of the upper triangle.
fn upper_triangle(pattern: &Pattern) -> (Vec<usize>, Vec<usize>) {
    let n = pattern.size;
    let mut start = vec![0usize; n + 1];
    for &r in &pattern.row {
        start[r + 1] += 1;
    }
    for i in 0..n {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut row = vec![0usize; pattern.row.len()];
    for column in 0..n {
        for &r in &pattern.row[pattern.column_start[column]..pattern.column_start[column + 1]] {
            row[next[r]] = column;
            next[r] += 1;
        }
    }
    (start, row)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pivoting {
    None,
    BunchKaufman,
}

/// Why a system was not solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Singular;

/// A matrix with its factor.
pub(crate) struct Direct {
    symbolic: Arc<Symbolic>,
    /// Lower triangle, and one place for entries that are not wanted.
    pub(crate) values: Vec<f64>,
    factor: Vec<f64>,
    subdiagonal: Vec<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
    pivoting: Pivoting,
    memory: MemBuffer,
    right: Vec<f64>,
    residual: Vec<f64>,
}

/// Residual that a solution must reach, relative to the right-hand side.
const ACCURACY: f64 = 1e-9;
/// Residual above which the factor is thrown away.
const USELESS: f64 = 1e-3;
const REFINEMENTS: usize = 4;

impl Direct {
    pub(crate) fn new(symbolic: Arc<Symbolic>) -> Result<Self, FemError> {
        let n = symbolic.pattern.size;
        let f = &symbolic.factor;
        let scratch = f
            .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
            .or(f.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default()))
            .or(f.solve_in_place_scratch::<f64>(1, Par::Seq));
        let memory = MemBuffer::try_new(scratch)
            .map_err(|_| FemError::Factorisation { unknowns: n, reason: "out of memory".into() })?;
        Ok(Self {
            values: vec![0.0; symbolic.pattern.len() + 1],
            factor: vec![0.0; f.len_val()],
            subdiagonal: vec![0.0; n],
            forward: vec![0; n],
            inverse: vec![0; n],
            pivoting: Pivoting::None,
            memory,
            right: vec![0.0; n],
            residual: vec![0.0; n],
            symbolic,
        })
    }

    pub(crate) fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// Factorises the matrix that is in `values`.
    pub(crate) fn factorise(&mut self) {
        let matrix = SparseColMatRef::new(
            self.symbolic.lower(),
            &self.values[..self.symbolic.pattern.len()],
        );
        let stack = MemStack::new(&mut self.memory);
        let plain = self.symbolic.factor.factorize_numeric_ldlt(
            &mut self.factor,
            matrix,
            Side::Lower,
            Default::default(),
            Par::Seq,
            stack,
            Default::default(),
        );
        self.pivoting = Pivoting::None;
        if plain.is_err() {
            self.factorise_with_pivots();
        }
    }

    fn factorise_with_pivots(&mut self) {
        let matrix = SparseColMatRef::new(
            self.symbolic.lower(),
            &self.values[..self.symbolic.pattern.len()],
        );
        self.symbolic.factor.factorize_numeric_intranode_lblt(
            &mut self.factor,
            &mut self.subdiagonal,
            &mut self.forward,
            &mut self.inverse,
            matrix,
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        self.pivoting = Pivoting::BunchKaufman;
    }

    /// Solves A x = b in place, with iterative refinement against the assembled matrix.
    pub(crate) fn solve(&mut self, x: &mut [f64]) -> Result<(), Singular> {
        self.right.copy_from_slice(x);
        let mut error = self.refine(x);
        if error.is_nan() || error > USELESS {
            if self.pivoting == Pivoting::BunchKaufman {
                return Err(Singular);
            }
            self.factorise_with_pivots();
            x.copy_from_slice(&self.right);
            error = self.refine(x);
        }
        if error <= USELESS { Ok(()) } else { Err(Singular) }
    }

    /// Applies the factor and refines; returns the relative residual.
    fn refine(&mut self, x: &mut [f64]) -> f64 {
        let size = norm(&self.right);
        if size == 0.0 {
            return 0.0;
        }
        self.apply(x);
        let mut error = f64::INFINITY;
        for round in 0..=REFINEMENTS {
            self.residual.copy_from_slice(&self.right);
            subtract_product(&self.symbolic.pattern, &self.values, x, &mut self.residual);
            let next = norm(&self.residual) / size;
            if next.is_nan() || next <= ACCURACY || next > 0.5 * error || round == REFINEMENTS {
                return next;
            }
            error = next;
            let mut correction = std::mem::take(&mut self.residual);
            self.apply(&mut correction);
            x.iter_mut().zip(&correction).for_each(|(x, c)| *x += c);
            self.residual = correction;
        }
        error
    }

    fn apply(&mut self, x: &mut [f64]) {
        let n = x.len();
        let right = MatMut::from_column_major_slice_mut(x, n, 1);
        let stack = MemStack::new(&mut self.memory);
        let factor = &self.symbolic.factor;
        match self.pivoting {
            Pivoting::None => LdltRef::new(factor, &self.factor).solve_in_place_with_conj(
                Conj::No,
                right,
                Par::Seq,
                stack,
            ),
            Pivoting::BunchKaufman => {
                let pivots = PermRef::new_checked(&self.forward, &self.inverse, n);
                IntranodeLbltRef::new(factor, &self.factor, &self.subdiagonal, pivots)
                    .solve_in_place_with_conj(Conj::No, right, Par::Seq, stack);
            }
        }
    }
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// y ← y − A x with the lower triangle of A.
fn subtract_product(pattern: &Pattern, values: &[f64], x: &[f64], y: &mut [f64]) {
    for column in 0..pattern.size {
        let mut sum = 0.0;
        for place in pattern.column_start[column]..pattern.column_start[column + 1] {
            let row = pattern.row[place];
            y[row] -= values[place] * x[column];
            if row != column {
                sum += values[place] * x[row];
            }
        }
        y[column] -= sum;
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::operator::Unknowns;

    /// The dense matrix of two tetrahedra that share a face, with random entries.
    fn random_matrix(zero_diagonal: bool) -> (Direct, Vec<Vec<f64>>) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let tets = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let unknowns = Unknowns::new(&[0, 1, 2, 3, 4], &[true; 5], std::iter::empty());
        let symbolic = Symbolic::new(Pattern::new(&tets, &unknowns)).expect("a structure");
        let mut direct = Direct::new(Arc::new(symbolic)).expect("memory");
        let n = unknowns.count;
        let mut dense = vec![vec![0.0; n]; n];
        for column in 0..n {
            let pattern = &direct.symbolic.pattern;
            for place in pattern.column_start[column]..pattern.column_start[column + 1] {
                let row = pattern.row[place];
                let entry = rng.random_range(-1.0..1.0);
                let entry = if row == column && zero_diagonal { 0.0 } else { entry };
                direct.values[place] = entry;
                dense[row][column] = entry;
                dense[column][row] = entry;
            }
        }
        (direct, dense)
    }

    #[test]
    fn indefinite_systems_are_solved_with_pivots_where_they_are_needed() {
        for zero_diagonal in [false, true] {
            let (mut direct, dense) = random_matrix(zero_diagonal);
            let n = dense.len();
            let exact: Vec<f64> = (0..n).map(|i| (i as f64 * 0.7).sin() + 0.2).collect();
            let mut x: Vec<f64> =
                dense.iter().map(|row| row.iter().zip(&exact).map(|(a, b)| a * b).sum()).collect();
            direct.factorise();
            direct.solve(&mut x).expect("a regular matrix");
            let error = x.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(error < 1e-7, "{error}");
            let pivots = direct.pivoting == Pivoting::BunchKaufman;
            assert!(pivots || !zero_diagonal, "a zero diagonal needs pivots");
        }
    }

    #[test]
    fn a_singular_matrix_is_reported() {
        let (mut direct, _) = random_matrix(false);
        direct.values.fill(0.0);
        direct.factorise();
        let mut x = vec![1.0; direct.right.len()];
        assert!(direct.solve(&mut x).is_err());
    }
}
