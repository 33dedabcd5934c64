//! Linear systems with the same matrix A, solved in a common space of search directions.
//!
//! The directions V are stored unchanged, and their products with A are orthonormalised: A V = Q R. The smallest
//! residual of A x = b in this space is b − Q c with c = Qᵀ b. The solution x = V R⁻¹ c is computed only on request
//! (generalised conjugate residuals: Eisenstat, Elman & Schultz 1983, doi:10.1137/0720023).
//!
//! Residuals of similar systems are nearly linearly dependent, so that one new direction per system would give nearly
//! equal directions. Therefore, new directions are computed only for the principal components of the residuals (block
//! methods with inexact breakdowns: Robbé & Sadkane, Linear Algebra Appl. 419 (2006) 265).
//!
//! New products are orthogonalised by classical Gram–Schmidt, all together and row by row, so that each stored product
//! is read from memory only once. The orthogonalisation is repeated if cancellation has made a product inaccurate.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::linear::{Nodal, add_scaled, weighted_dot};

/// The orthogonalisation of a vector is repeated if it reduces the norm of the vector below this fraction of the norm
/// before the orthogonalisation.
const LOSS: f64 = 0.1;
/// A search direction is dropped if orthogonalisation reduces the norm of its product with A below this fraction of the
/// norm before the orthogonalisation.
const DEPENDENT: f64 = 1e-6;
/// No new direction is computed for a principal component that is smaller than this multiple of the allowed residual.
const SMALL: f64 = 0.5;
/// Number of nodes per parallel task.
const CHUNK: usize = 4096;
/// Number of nodes that a task processes together; their values fit into the first-level cache.
const PART: usize = 32;

/// A linear system A x = b that is being solved.
pub(super) struct System {
    pub(super) x: Vec<Nodal>,
    /// Right-hand side minus the product of A with the solution, for all nodal values.
    pub(super) residual: Vec<Nodal>,
    /// Norm of the initial residual.
    size: f64,
    /// Norm that the initial residual would have if all unknowns of a field were as stiff as the stiffest unknown of
    /// the field.
    stiffest: f64,
    /// Allowed norm of the residual, relative to the norm of the initial residual (`size`).
    tolerance: f64,
    /// Part of the solution that is not yet added to `x`, given by its coefficients in the orthonormal basis Q.
    along: Vec<f64>,
}

impl System {
    /// Whether the initial residual is zero, so that the initial solution is exact.
    pub(super) fn vanishes(&self) -> bool {
        self.size == 0.0
    }
}

/// Search directions V, with an orthonormal basis Q of their products A V = Q R.
pub(super) struct Directions {
    /// Weight w_i of each nodal residual r_i in the norm √(Σ w_i r_i²).
    weight: Vec<Nodal>,
    /// Smallest positive weight of each component u_x, u_y, u_z, φ; 0 for a component without positive weights.
    least: Nodal,
    /// The columns of V.
    directions: Vec<Vec<Nodal>>,
    /// The columns of Q.
    products: Vec<Vec<Nodal>>,
    /// The columns of the upper triangular matrix R.
    triangle: Vec<Vec<f64>>,
}

impl Directions {
    /// Creates an empty set of search directions. `weight` contains the weights of the residual norm.
    pub(super) fn new(weight: Vec<Nodal>) -> Self {
        let mut least = [f64::INFINITY; 4];
        for weight in &weight {
            for k in 0..4 {
                least[k] = if weight[k] > 0.0 { least[k].min(weight[k]) } else { least[k] };
            }
        }
        let least = least.map(|w| if w.is_finite() { w } else { 0.0 });
        let [directions, products] = [const { Vec::new() }; 2];
        Self { weight, least, directions, products, triangle: Vec::new() }
    }

    pub(super) fn count(&self) -> usize {
        self.directions.len()
    }

    /// Creates a system with the initial solution `x`; `residual` is the right-hand side minus the product of A with
    /// `x`.
    pub(super) fn system(&self, x: Vec<Nodal>, residual: Vec<Nodal>, tolerance: f64) -> System {
        let (size, along) = (self.norm(&residual), Vec::new());
        // the weight is zero for values that are not unknowns
        let square = |(w, r): (&Nodal, &Nodal)| {
            let term = |k: usize| if w[k] > 0.0 { self.least[k] * r[k] * r[k] } else { 0.0 };
            (0..4).map(term).sum::<f64>()
        };
        let stiffest = self.weight.iter().zip(&residual).map(square).sum::<f64>().sqrt();
        System { x, size, stiffest, residual, tolerance, along }
    }

    /// Returns the norm of the solution of a system, relative to the norm that the solution would have if all
    /// unknowns of a field were as stiff as the stiffest unknown of the field. Precondition: [`form`](Self::form) has
    /// been called.
    pub(super) fn growth(&self, system: &System) -> f64 {
        let square = |x: &Nodal| {
            let term =
                |k: usize| if self.least[k] > 0.0 { x[k] * x[k] / self.least[k] } else { 0.0 };
            (0..4).map(term).sum::<f64>()
        };
        let size = system.x.iter().map(square).sum::<f64>().sqrt();
        if system.stiffest > 0.0 { size / system.stiffest } else { 0.0 }
    }

    fn norm(&self, x: &[Nodal]) -> f64 {
        weighted_dot(&self.weight, x, x).sqrt()
    }

    /// Returns the norm of the residual of a system, as a multiple of the allowed norm.
    pub(super) fn excess(&self, system: &System) -> f64 {
        if system.size > 0.0 {
            self.norm(&system.residual) / (system.tolerance * system.size)
        } else {
            0.0
        }
    }

    /// Whether a system is solved; false if the residual is NaN.
    pub(super) fn solved(&self, system: &System) -> bool {
        self.excess(system) <= 1.0
    }

    /// Principal components of the residuals of the unsolved systems: orthogonal linear combinations of the residuals,
    /// each divided by the allowed residual of its system.
    ///
    /// Returns the norm of the largest component, and the components in order of decreasing norm. Components with a norm
    /// below [`SMALL`], or below `share` times the largest norm, are omitted.
    pub(super) fn principal(&self, systems: &[System], share: f64) -> (f64, Vec<Vec<Nodal>>) {
        let unsolved: Vec<&System> = systems.iter().filter(|system| !self.solved(system)).collect();
        let units: Vec<f64> = unsolved.iter().map(|s| 1.0 / (s.tolerance * s.size)).collect();
        let products = DMatrix::from_fn(unsolved.len(), unsolved.len(), |i, j| {
            let [a, b] = [i.min(j), i.max(j)].map(|k| &unsolved[k].residual);
            units[i] * units[j] * weighted_dot(&self.weight, a, b)
        });
        if unsolved.is_empty() || products.iter().any(|product| !product.is_finite()) {
            return (0.0, Vec::new());
        }
        let SymmetricEigen { eigenvalues, eigenvectors } = products.symmetric_eigen();
        let mut components: Vec<(f64, usize)> =
            eigenvalues.iter().map(|square| square.max(0.0).sqrt()).zip(0..).collect();
        components.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let largest = components.first().map_or(0.0, |(size, _)| *size);
        let combination = |axis: usize| {
            let mut sum = vec![[0.0; 4]; self.weight.len()];
            for (i, system) in unsolved.iter().enumerate() {
                add_scaled(&mut sum, units[i] * eigenvectors[(i, axis)], &system.residual);
            }
            sum
        };
        let large = components.iter().filter(|(size, _)| *size > SMALL.max(share * largest));
        (largest, large.map(|(_, axis)| combination(*axis)).collect())
    }

    /// Adds search directions with their products with A. Directions that depend linearly on the other directions are
    /// dropped.
    pub(super) fn add(&mut self, directions: Vec<Vec<Nodal>>, mut products: Vec<Vec<Nodal>>) {
        let count_before = self.count();
        let whole: Vec<f64> = products.iter().map(|p| self.norm(p)).collect();
        let mut columns = vec![vec![0.0; count_before]; products.len()];
        for _ in 0..2 {
            let coefficients =
                subtract_projections(&self.weight, &self.products, &mut slices(&mut products));
            columns.iter_mut().zip(&coefficients).for_each(|(column, added)| sum(column, added));
            if products.iter().zip(&whole).all(|(p, whole)| self.norm(p) > LOSS * whole) {
                break;
            }
        }
        let candidates = directions.into_iter().zip(products).zip(columns);
        for (((direction, mut product), mut column), whole) in candidates.zip(whole) {
            column.resize(self.count(), 0.0);
            for _ in 0..2 {
                let others = &self.products[count_before..];
                let coefficients = subtract_projections(&self.weight, others, &mut [&mut product]);
                sum(&mut column[count_before..], &coefficients[0]);
            }
            let norm = self.norm(&product);
            if norm > DEPENDENT * whole && norm.is_finite() {
                product.as_flattened_mut().iter_mut().for_each(|x| *x /= norm);
                column.push(norm);
                self.directions.push(direction);
                self.products.push(product);
                self.triangle.push(column);
            }
        }
    }

    /// Subtracts from each residual the steps along the directions with index `from` or higher that minimise the norm
    /// of the residual. The steps are stored in `along`.
    pub(super) fn reduce(&self, from: usize, systems: &mut [System]) {
        let mut residuals: Vec<&mut [Nodal]> =
            systems.iter_mut().map(|system| &mut system.residual[..]).collect();
        let coefficients =
            subtract_projections(&self.weight, &self.products[from..], &mut residuals);
        for (system, coefficients) in systems.iter_mut().zip(coefficients) {
            system.along.resize(self.count(), 0.0);
            sum(&mut system.along[from..], &coefficients);
        }
    }

    /// Adds the accumulated steps of a system to its solution `x`.
    pub(super) fn form(&self, system: &mut System) {
        // solve R y = c by back substitution, column by column
        let mut y = std::mem::take(&mut system.along);
        for (j, column) in self.triangle[..y.len()].iter().enumerate().rev() {
            y[j] /= column[j];
            let last = y[j];
            y[..j].iter_mut().zip(column).for_each(|(y, r)| *y -= r * last);
        }
        y.iter_mut().for_each(|y| *y = -*y);
        system.x.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, x)| {
            subtract(&self.directions, CHUNK * chunk, &y, x);
        });
    }
}

fn slices(vectors: &mut [Vec<Nodal>]) -> Vec<&mut [Nodal]> {
    vectors.iter_mut().map(Vec::as_mut_slice).collect()
}

fn sum(to: &mut [f64], terms: &[f64]) {
    to.iter_mut().zip(terms).for_each(|(to, part)| *to += part);
}

/// Subtracts from each column its projections on the orthonormal vectors `basis`. Returns the coefficients of the
/// projections.
fn subtract_projections(
    weight: &[Nodal],
    basis: &[Vec<Nodal>],
    columns: &mut [&mut [Nodal]],
) -> Vec<Vec<f64>> {
    let mut sums = vec![0.0; columns.len() * basis.len()];
    if sums.is_empty() {
        return vec![Vec::new(); columns.len()];
    }
    let coefficients_of_chunks: Vec<Vec<f64>> = {
        let columns: Vec<&[Nodal]> = columns.iter().map(|column| &**column).collect();
        let chunks = 0..weight.len().div_ceil(CHUNK);
        chunks.into_par_iter().map(|chunk| products(weight, basis, &columns, chunk)).collect()
    };
    coefficients_of_chunks.iter().for_each(|part| sum(&mut sums, part));
    let sums: Vec<Vec<f64>> = sums.chunks_exact(basis.len()).map(<[f64]>::to_vec).collect();
    for (column, sums) in columns.iter_mut().zip(&sums) {
        column.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, column)| {
            subtract(basis, CHUNK * chunk, sums, column);
        });
    }
    sums
}

/// Returns the weighted inner products of each column with every vector of `basis`, restricted to the nodes
/// of a chunk.
fn products(
    weight: &[Nodal],
    basis: &[Vec<Nodal>],
    columns: &[&[Nodal]],
    chunk: usize,
) -> Vec<f64> {
    let mut sums = vec![0.0; columns.len() * basis.len()];
    let mut weighted = vec![[[0.0; 4]; PART]; columns.len()];
    let end = weight.len().min(CHUNK * (chunk + 1));
    for begin in (CHUNK * chunk..end).step_by(PART) {
        let range = begin..end.min(begin + PART);
        for (weighted, column) in weighted.iter_mut().zip(columns) {
            let rows = weight[range.clone()].iter().zip(&column[range.clone()]);
            for (out, (w, x)) in weighted.iter_mut().zip(rows) {
                *out = std::array::from_fn(|k| w[k] * x[k]);
            }
        }
        for (b, vector) in basis.iter().enumerate() {
            let vector = &vector[range.clone()];
            for (c, weighted) in weighted.iter().enumerate() {
                let mut sum = [0.0; 4];
                for (a, b) in vector.iter().zip(weighted) {
                    for k in 0..4 {
                        sum[k] += a[k] * b[k];
                    }
                }
                sums[c * basis.len() + b] += (sum[0] + sum[1]) + (sum[2] + sum[3]);
            }
        }
    }
    sums
}

/// Computes x ← x − Σ c v, four vectors v at a time. `x` contains the nodes from node `first` on.
fn subtract(vectors: &[Vec<Nodal>], first: usize, coefficients: &[f64], x: &mut [Nodal]) {
    for (part, x) in x.chunks_mut(PART).enumerate() {
        let range = first + part * PART..first + part * PART + x.len();
        for (vectors, c) in vectors.chunks(4).zip(coefficients.chunks(4)) {
            if let ([p, q, r, s], &[a, b, c, d]) = (vectors, c) {
                let [p, q, r, s] = [p, q, r, s].map(|v| &v[range.clone()]);
                for ((((x, p), q), r), s) in x.iter_mut().zip(p).zip(q).zip(r).zip(s) {
                    for k in 0..4 {
                        x[k] -= (a * p[k] + b * q[k]) + (c * r[k] + d * s[k]);
                    }
                }
            } else {
                for (vector, c) in vectors.iter().zip(c) {
                    for (x, v) in x.iter_mut().zip(&vector[range.clone()]) {
                        for k in 0..4 {
                            x[k] -= c * v[k];
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/directions.rs"]
mod tests;
