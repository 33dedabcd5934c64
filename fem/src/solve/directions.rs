//! Solutions of several systems with one matrix A in the space of directions that they share.
//!
//! Of directions V the products are kept orthonormal, A V = Q R, and the directions as they came: the
//! least residual of A x = b is b − Q c with c = Qᵀ b, and x = V R⁻¹ c is formed once it is asked for
//! (generalised conjugate residuals: Eisenstat, Elman & Schultz 1983, doi:10.1137/0720023).
//!
//! Residuals of systems that are alike lie nearly in a line or a plane, and a direction for each would be
//! found several times over. Directions are asked for their principal parts alone (block methods with
//! inexact breakdowns: Robbé & Sadkane, Linear Algebra Appl. 419 (2006) 265).
//!
//! Products are made orthogonal several at a time and row by row, so that those at hand are read once
//! for all of them: classical Gram–Schmidt, a second time where digits were lost.

use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::linear::{Nodal, add_scaled, weighted_dot};

/// A product of which this little is left by those before it is made orthogonal to them once more.
const LOSS: f64 = 0.1;
/// A direction that lies in those before it up to this is none of its own.
const DEPENDENT: f64 = 1e-6;
/// A part of the residuals below this multiple of what may be left of one needs no direction.
const SMALL: f64 = 0.5;
/// Nodes that a task works on, in parts that stay in the innermost cache.
const CHUNK: usize = 4096;
const PART: usize = 32;

/// A system that is being solved.
pub(super) struct System {
    pub(super) x: Vec<Nodal>,
    /// Right-hand side less the product with the solution, on all values.
    pub(super) residual: Vec<Nodal>,
    /// Of the residual at first.
    size: f64,
    /// The same if all values were as stiff as the stiffest of their field.
    stiffest: f64,
    tolerance: f64,
    /// What the solution is beside x: multiples of the orthonormal products.
    along: Vec<f64>,
}

impl System {
    /// Whether there is nothing to solve.
    pub(super) fn vanishes(&self) -> bool {
        self.size == 0.0
    }
}

/// Directions whose products with the matrix are orthonormal combinations.
pub(super) struct Directions {
    weight: Vec<Nodal>,
    /// The least weight of the values of each field that has some.
    least: Nodal,
    directions: Vec<Vec<Nodal>>,
    products: Vec<Vec<Nodal>>,
    /// The columns of R.
    triangle: Vec<Vec<f64>>,
}

impl Directions {
    /// None yet; `weight` is that of the norm of residuals.
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

    /// A system of which `residual` is the right-hand side less the product with x.
    pub(super) fn system(&self, x: Vec<Nodal>, residual: Vec<Nodal>, tolerance: f64) -> System {
        let (size, along) = (self.norm(&residual), Vec::new());
        // values that are not solved for have no weight
        let seen = |(w, r): (&Nodal, &Nodal)| {
            let of = |k: usize| if w[k] > 0.0 { self.least[k] * r[k] * r[k] } else { 0.0 };
            (0..4).map(of).sum::<f64>()
        };
        let stiffest = self.weight.iter().zip(&residual).map(seen).sum::<f64>().sqrt();
        System { x, size, stiffest, residual, tolerance, along }
    }

    /// How much larger the solution of a system is, once it is formed, than it would be if all values were
    /// as stiff as the stiffest of their field.
    pub(super) fn growth(&self, system: &System) -> f64 {
        let square = |x: &Nodal| {
            let of = |k: usize| if self.least[k] > 0.0 { x[k] * x[k] / self.least[k] } else { 0.0 };
            (0..4).map(of).sum::<f64>()
        };
        let size = system.x.iter().map(square).sum::<f64>().sqrt();
        if system.stiffest > 0.0 { size / system.stiffest } else { 0.0 }
    }

    fn norm(&self, x: &[Nodal]) -> f64 {
        weighted_dot(&self.weight, x, x).sqrt()
    }

    /// The residual of a system as a multiple of the one that it may have.
    pub(super) fn excess(&self, system: &System) -> f64 {
        if system.size > 0.0 {
            self.norm(&system.residual) / (system.tolerance * system.size)
        } else {
            0.0
        }
    }

    /// Whether a system is solved; not by a number that is none.
    pub(super) fn solved(&self, system: &System) -> bool {
        self.excess(system) <= 1.0
    }

    /// What is left of the systems that are not solved, in parts that are orthogonal to each other: combinations
    /// of the residuals, each of which counts in multiples of what may be left of it. The largest comes first
    /// and its size with them; those that are small, or less than `share` times it, are left out.
    pub(super) fn principal(&self, systems: &[System], share: f64) -> (f64, Vec<Vec<Nodal>>) {
        let open: Vec<&System> = systems.iter().filter(|system| !self.solved(system)).collect();
        let units: Vec<f64> = open.iter().map(|s| 1.0 / (s.tolerance * s.size)).collect();
        let products = DMatrix::from_fn(open.len(), open.len(), |i, j| {
            let [a, b] = [i.min(j), i.max(j)].map(|k| &open[k].residual);
            units[i] * units[j] * weighted_dot(&self.weight, a, b)
        });
        if open.is_empty() || products.iter().any(|product| !product.is_finite()) {
            return (0.0, Vec::new());
        }
        let SymmetricEigen { eigenvalues, eigenvectors } = products.symmetric_eigen();
        let mut parts: Vec<(f64, usize)> =
            eigenvalues.iter().map(|square| square.max(0.0).sqrt()).zip(0..).collect();
        parts.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let largest = parts.first().map_or(0.0, |(size, _)| *size);
        let combination = |axis: usize| {
            let mut sum = vec![[0.0; 4]; self.weight.len()];
            for (i, system) in open.iter().enumerate() {
                add_scaled(&mut sum, units[i] * eigenvectors[(i, axis)], &system.residual);
            }
            sum
        };
        let large = parts.iter().filter(|(size, _)| *size > SMALL.max(share * largest));
        (largest, large.map(|(_, axis)| combination(*axis)).collect())
    }

    /// Takes up directions with their products, but those that lie in the others.
    pub(super) fn add(&mut self, directions: Vec<Vec<Nodal>>, mut products: Vec<Vec<Nodal>>) {
        let known = self.count();
        let whole: Vec<f64> = products.iter().map(|p| self.norm(p)).collect();
        let mut columns = vec![vec![0.0; known]; products.len()];
        for _ in 0..2 {
            let parts = take_off(&self.weight, &self.products, &mut slices(&mut products));
            columns.iter_mut().zip(&parts).for_each(|(column, parts)| sum(column, parts));
            if products.iter().zip(&whole).all(|(p, whole)| self.norm(p) > LOSS * whole) {
                break;
            }
        }
        let own = directions.into_iter().zip(products).zip(columns);
        for (((direction, mut product), mut column), whole) in own.zip(whole) {
            column.resize(self.count(), 0.0);
            for _ in 0..2 {
                let others = &self.products[known..];
                let parts = take_off(&self.weight, others, &mut [&mut product]);
                sum(&mut column[known..], &parts[0]);
            }
            let own = self.norm(&product);
            if own > DEPENDENT * whole && own.is_finite() {
                product.as_flattened_mut().iter_mut().for_each(|x| *x /= own);
                column.push(own);
                self.directions.push(direction);
                self.products.push(product);
                self.triangle.push(column);
            }
        }
    }

    /// Moves the solutions along the directions from one on so that their residuals are least.
    pub(super) fn reduce(&self, from: usize, systems: &mut [System]) {
        let mut residuals: Vec<&mut [Nodal]> =
            systems.iter_mut().map(|system| &mut system.residual[..]).collect();
        let parts = take_off(&self.weight, &self.products[from..], &mut residuals);
        for (system, parts) in systems.iter_mut().zip(parts) {
            system.along.resize(self.count(), 0.0);
            sum(&mut system.along[from..], &parts);
        }
    }

    /// Forms x of a system.
    pub(super) fn form(&self, system: &mut System) {
        // R y = c by columns, from the last
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

fn sum(to: &mut [f64], parts: &[f64]) {
    to.iter_mut().zip(parts).for_each(|(to, part)| *to += part);
}

/// Takes off each column its parts along orthonormal vectors, and returns these.
fn take_off(weight: &[Nodal], basis: &[Vec<Nodal>], columns: &mut [&mut [Nodal]]) -> Vec<Vec<f64>> {
    let mut sums = vec![0.0; columns.len() * basis.len()];
    if sums.is_empty() {
        return vec![Vec::new(); columns.len()];
    }
    let parts: Vec<Vec<f64>> = {
        let columns: Vec<&[Nodal]> = columns.iter().map(|column| &**column).collect();
        let chunks = 0..weight.len().div_ceil(CHUNK);
        chunks.into_par_iter().map(|chunk| products(weight, basis, &columns, chunk)).collect()
    };
    parts.iter().for_each(|part| sum(&mut sums, part));
    let sums: Vec<Vec<f64>> = sums.chunks_exact(basis.len()).map(<[f64]>::to_vec).collect();
    for (column, sums) in columns.iter_mut().zip(&sums) {
        column.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, column)| {
            subtract(basis, CHUNK * chunk, sums, column);
        });
    }
    sums
}

/// Inner products on the nodes of a chunk, of each column with every vector.
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

/// x ← x − Σ c v on the nodes from `first` on, four vectors at a time.
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
