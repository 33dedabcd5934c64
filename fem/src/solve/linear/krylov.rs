//! Krylov methods on nodal vectors in the memory of this process or of a device, with initial solution zero.
//!
//! - conjugate gradients for symmetric positive definite matrices (Hestenes & Stiefel 1952,
//!   doi:10.6028/jres.049.044), flexible (Notay 2000, doi:10.1137/S1064827599362314);
//! - flexible GMRES with restarts for all other matrices (Saad 1993, doi:10.1137/0914028).

use std::borrow::BorrowMut;

use super::vectors::{KrylovVectors, Precision, Vectors};

/// Matrix A with a preconditioner. The constrained values of all vectors are zero.
pub(crate) trait Preconditioned<V: Vectors> {
    /// y = A x.
    fn apply(&mut self, x: &V::Vector, y: &mut V::Vector);

    /// Computes z ≈ A⁻¹ r. The old z is not read.
    fn precondition(&mut self, r: &V::Vector, z: &mut V::Vector);
}

/// Matrix of a linear system with its preconditioner, vector operations and norm.
pub(super) struct System<'a, V: Vectors> {
    pub(super) vectors: &'a V,
    pub(super) matrix: &'a mut dyn Preconditioned<V>,
    /// Weights 1/|A_ii| of the residual norm, from the diagonal entries A_ii. The weights make residuals of
    /// displacement and damage comparable.
    pub(super) weight: &'a V::Vector,
}

impl<V: KrylovVectors> System<'_, V> {
    /// Returns the weighted norm of a residual.
    fn norm(&self, r: &V::Vector) -> f64 {
        self.vectors.weighted_dot(self.weight, r, r).sqrt()
    }
}

/// Reason for the end of a Krylov method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    Converged,
    /// The limit of iterations was reached.
    Limit,
    /// The curvature d·A d along a search direction d was not positive: the matrix A or the preconditioner is not
    /// positive definite.
    Indefinite,
    /// A value was not finite.
    Broken,
}

/// Result of a Krylov method, without the solution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ending {
    pub(super) stop: Stop,
    pub(super) iterations: u32,
    /// Weighted norm of the residual, divided by the weighted norm of the right-hand side.
    pub(super) residual: f64,
}

/// Number of iterations between restarts of GMRES.
const RESTART: usize = 40;
/// Smallest tolerance for which GMRES stores its basis in single precision. In a large system, the two vectors stored
/// per iteration need more memory than all other data.
const COARSE: f64 = 1e-4;

/// Solves by conjugate gradients while the tangent is `definite`. If negative curvature occurs, sets `definite` to
/// false and continues with GMRES from the current solution.
pub(super) fn solve<V: KrylovVectors>(
    system: &mut System<V>,
    definite: &mut bool,
    right: &V::Vector,
    x: &mut V::Vector,
    tolerance: f64,
    limit: u32,
) -> Ending {
    let mut spent = 0;
    if *definite {
        let ending = conjugate_gradients(system, right, x, tolerance, limit);
        if matches!(ending.stop, Stop::Converged | Stop::Limit) {
            return ending;
        }
        *definite = false;
        spent = ending.iterations;
    }
    let start = if spent == 0 { Start::Zero } else { Start::Given };
    let ending = gmres(system, right, x, start, tolerance, limit);
    Ending { iterations: spent + ending.iterations, ..ending }
}

fn conjugate_gradients<V: KrylovVectors>(
    system: &mut System<V>,
    right: &V::Vector,
    x: &mut V::Vector,
    tolerance: f64,
    limit: u32,
) -> Ending {
    let vectors = system.vectors;
    let [mut z, mut p, mut q] = [(); 3].map(|()| vectors.zero(right));
    let [z, p, q] = [&mut z, &mut p, &mut q].map(BorrowMut::borrow_mut);
    let mut r = vectors.zero(right);
    let r: &mut V::Vector = r.borrow_mut();
    vectors.copy(right, r);
    vectors.clear(x);
    let size = system.norm(r);
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    if size == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    let (mut before, mut step, mut residual) = (0.0, 0.0, 1.0);
    for iteration in 0..limit {
        system.matrix.precondition(r, z);
        let product = vectors.dot(r, z);
        if !product.is_finite() {
            return ending(Stop::Broken, iteration, residual);
        }
        if product <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        // the flexible method uses z·(r_k − r_{k−1}) instead of z·r_k, where z is the preconditioned residual r_k; both
        // products are equal for a linear preconditioner, but only with the first product the directions stay conjugate
        // if the preconditioner rounds to single precision
        let share = if iteration == 0 { 0.0 } else { -step * vectors.dot(q, z) / before };
        vectors.scale_and_add(p, share, z);
        system.matrix.apply(p, q);
        let curvature = vectors.dot(p, q);
        if curvature <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        step = product / curvature;
        vectors.add_scaled(x, step, p);
        vectors.add_scaled(r, -step, q);
        before = product;
        residual = system.norm(r) / size;
        if !residual.is_finite() {
            return ending(Stop::Broken, iteration + 1, residual);
        }
        if residual <= tolerance {
            return ending(Stop::Converged, iteration + 1, residual);
        }
    }
    ending(Stop::Limit, limit, residual)
}

/// Initial solution of GMRES.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Start {
    Zero,
    /// The given x, or x = 0 if the residual of x = 0 is smaller.
    Given,
}

fn gmres<V: KrylovVectors>(
    system: &mut System<V>,
    right: &V::Vector,
    x: &mut V::Vector,
    start: Start,
    tolerance: f64,
    limit: u32,
) -> Ending {
    let vectors = system.vectors;
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    let size = system.norm(right);
    if size == 0.0 {
        vectors.clear(x);
        return ending(Stop::Converged, 0, 0.0);
    }
    let mut r = vectors.zero(right);
    let r: &mut V::Vector = r.borrow_mut();
    let mut norm = f64::NAN;
    if start == Start::Given {
        system.matrix.apply(x, r);
        vectors.scale_and_add(r, -1.0, right);
        norm = system.norm(r);
    }
    if norm.is_nan() || norm >= size {
        vectors.clear(x);
        vectors.copy(right, r);
        norm = size;
    }
    // convergence is tested with the true residual, so that a basis in single precision does not reduce the accuracy
    let precision = if tolerance >= COARSE { Precision::Single } else { Precision::Double };
    let mut done = 0;
    while done < limit {
        let rounds = RESTART.min((limit - done) as usize);
        match arnoldi(system, r, norm, x, rounds, tolerance * size, precision) {
            Ok(iterations) => done += iterations,
            Err(iterations) => return ending(Stop::Broken, done + iterations, norm / size),
        }
        system.matrix.apply(x, r);
        vectors.scale_and_add(r, -1.0, right);
        let reached = system.norm(r);
        if !reached.is_finite() {
            return ending(Stop::Broken, done, reached);
        }
        if reached <= tolerance * size {
            return ending(Stop::Converged, done, reached / size);
        }
        if reached > 0.99 * norm {
            return ending(Stop::Limit, done, reached / size);
        }
        norm = reached;
    }
    ending(Stop::Limit, done, norm / size)
}

/// Adds to x the correction of at most `rounds` GMRES steps for a residual of the given norm; stops early if the norm
/// of the residual falls below `target`. Returns the number of steps: `Ok` normally, `Err` if a value is not finite.
fn arnoldi<V: KrylovVectors>(
    system: &mut System<V>,
    residual: &V::Vector,
    norm: f64,
    x: &mut V::Vector,
    rounds: usize,
    target: f64,
    precision: Precision,
) -> Result<u32, u32> {
    let vectors = system.vectors;
    let [mut v, mut z, mut w] = [(); 3].map(|()| vectors.zero(residual));
    let [v, z, w]: [&mut V::Vector; 3] = [&mut v, &mut z, &mut w].map(BorrowMut::borrow_mut);
    let (mut basis, mut directions): (Vec<V::Stored>, Vec<V::Stored>) = (Vec::new(), Vec::new());
    let mut hessenberg: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut g = vec![norm];
    vectors.add_scaled(v, 1.0 / norm, residual);
    for j in 0..rounds {
        basis.push(vectors.store(v, precision));
        system.matrix.precondition(v, z);
        system.matrix.apply(z, w);
        directions.push(vectors.store(z, precision));
        let mut column = Vec::with_capacity(j + 2);
        for v in &basis {
            let h = vectors.weighted_dot_stored(system.weight, v, w);
            vectors.add_stored(w, -h, v);
            column.push(h);
        }
        let next = system.norm(w);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let rho = column[j].hypot(next);
        if !next.is_finite() || rho == 0.0 {
            return Err(j as u32);
        }
        let (c, s) = (column[j] / rho, next / rho);
        rotations.push((c, s));
        column[j] = rho;
        hessenberg.push(column);
        g.push(-s * g[j]);
        g[j] *= c;
        if g[j + 1].abs() <= target || next == 0.0 {
            break;
        }
        vectors.clear(v);
        vectors.add_scaled(v, 1.0 / next, w);
    }
    for (y, z) in back_substitution(&hessenberg, &g).into_iter().zip(&directions) {
        vectors.add_stored(x, y, z);
    }
    Ok(hessenberg.len() as u32)
}

/// Returns the solution y of R y = g. `columns` contains the columns of the upper triangular matrix R.
fn back_substitution(columns: &[Vec<f64>], g: &[f64]) -> Vec<f64> {
    let mut y = g[..columns.len()].to_vec();
    for j in (0..columns.len()).rev() {
        y[j] /= columns[j][j];
        for i in 0..j {
            y[i] -= columns[j][i] * y[j];
        }
    }
    y
}

#[cfg(test)]
#[path = "../../../tests/unit/krylov.rs"]
mod tests;
