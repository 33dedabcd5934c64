//! Krylov methods on nodal vectors, wherever these are, each started from zero.
//!
//! - conjugate gradients: symmetric positive definite (Hestenes & Stiefel 1952,
//!   doi:10.6028/jres.049.044);
//! - flexible GMRES with restarts: anything (Saad 1993, doi:10.1137/0914028).

use std::borrow::{Borrow, BorrowMut};

use super::vector::Vectors;

/// y = f(x).
pub(super) type Map<'a, V> = dyn FnMut(&<V as Vectors>::Vector, &mut <V as Vectors>::Vector) + 'a;

/// A linear system without its right-hand side; vectors are zero in constrained values.
pub(super) struct System<'a, V: Vectors> {
    pub(super) vectors: &'a V,
    pub(super) apply: &'a mut Map<'a, V>,
    pub(super) precondition: &'a mut Map<'a, V>,
    /// 1/|A_ii|, the weight of the norm in which residuals are measured, so that forces and damage
    /// count alike.
    pub(super) weight: &'a V::Vector,
}

impl<V: Vectors> System<'_, V> {
    /// The norm in which residuals are measured.
    fn norm(&self, r: &V::Vector) -> f64 {
        self.vectors.weighted_dot(self.weight, r, r).sqrt()
    }
}

/// Why a method ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    Converged,
    /// As many iterations as were allowed.
    Limit,
    /// A direction without positive curvature: matrix or preconditioner is not definite.
    Indefinite,
    /// Not a number.
    Broken,
}

/// How a method ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ending {
    pub(super) stop: Stop,
    pub(super) iterations: u32,
    /// Relative to the right-hand side, in the weighted norm.
    pub(super) residual: f64,
}

/// Iterations between restarts of GMRES.
const RESTART: usize = 40;

/// Conjugate gradients while the tangent is `definite`, and GMRES from where it turns out not to be.
pub(super) fn solve<V: Vectors>(
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
    let ending = gmres(system, right, x, tolerance, limit);
    Ending { iterations: spent + ending.iterations, ..ending }
}

fn conjugate_gradients<V: Vectors>(
    system: &mut System<V>,
    right: &V::Vector,
    x: &mut V::Vector,
    tolerance: f64,
    limit: u32,
) -> Ending {
    let vectors = system.vectors;
    let [mut z, mut p, mut q] = [(); 3].map(|()| vectors.zero(right));
    let [z, p, q] = [&mut z, &mut p, &mut q].map(BorrowMut::borrow_mut);
    let mut r = vectors.scaled(right, 1.0);
    let r: &mut V::Vector = r.borrow_mut();
    vectors.clear(x);
    let size = system.norm(r);
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    if size == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    let (mut before, mut residual) = (0.0, 1.0);
    for iteration in 0..limit {
        (system.precondition)(r, z);
        let product = vectors.dot(r, z);
        if !product.is_finite() {
            return ending(Stop::Broken, iteration, residual);
        }
        if product <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        vectors.scale_and_add(p, if iteration == 0 { 0.0 } else { product / before }, z);
        (system.apply)(p, q);
        let curvature = vectors.dot(p, q);
        if curvature <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        let step = product / curvature;
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

fn gmres<V: Vectors>(
    system: &mut System<V>,
    right: &V::Vector,
    x: &mut V::Vector,
    tolerance: f64,
    limit: u32,
) -> Ending {
    let vectors = system.vectors;
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    vectors.clear(x);
    let mut r = vectors.scaled(right, 1.0);
    let r: &mut V::Vector = r.borrow_mut();
    let size = system.norm(r);
    if size == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    let mut done = 0;
    let mut norm = size;
    while done < limit {
        let rounds = RESTART.min((limit - done) as usize);
        let mut basis = vec![vectors.scaled(r, 1.0 / norm)];
        let mut directions: Vec<V::Owned> = Vec::new();
        let mut hessenberg: Vec<Vec<f64>> = Vec::new();
        let mut rotations: Vec<(f64, f64)> = Vec::new();
        let mut g = vec![norm];
        for j in 0..rounds {
            let (mut z, mut w) = (vectors.zero(right), vectors.zero(right));
            (system.precondition)(basis[j].borrow(), z.borrow_mut());
            (system.apply)(z.borrow(), w.borrow_mut());
            directions.push(z);
            let mut column = Vec::with_capacity(j + 2);
            for v in &basis {
                let h = vectors.weighted_dot(system.weight, v.borrow(), w.borrow());
                vectors.add_scaled(w.borrow_mut(), -h, v.borrow());
                column.push(h);
            }
            let next = system.norm(w.borrow());
            if !next.is_finite() {
                return ending(Stop::Broken, done, norm / size);
            }
            for (i, &(c, s)) in rotations.iter().enumerate() {
                let (a, b) = (column[i], column[i + 1]);
                (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
            }
            let rho = column[j].hypot(next);
            if rho == 0.0 {
                return ending(Stop::Broken, done, norm / size);
            }
            let (c, s) = (column[j] / rho, next / rho);
            rotations.push((c, s));
            column[j] = rho;
            hessenberg.push(column);
            g.push(-s * g[j]);
            g[j] *= c;
            done += 1;
            if g[j + 1].abs() <= tolerance * size || next == 0.0 {
                break;
            }
            basis.push(vectors.scaled(w.borrow(), 1.0 / next));
        }
        for (y, z) in back_substitution(&hessenberg, &g).into_iter().zip(&directions) {
            vectors.add_scaled(x, y, z.borrow());
        }
        (system.apply)(x, r);
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

/// y of R y = g, with the columns of R.
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
