//! Krylov methods on nodal vectors, each started from zero.
//!
//! - conjugate gradients: symmetric positive definite (Hestenes & Stiefel 1952,
//!   doi:10.6028/jres.049.044);
//! - flexible GMRES with restarts: anything (Saad 1993, doi:10.1137/0914028).

use super::vector::{Nodal, add_scaled, dot, scale_and_add, weighted_dot};

/// y = f(x).
pub(super) type Map<'a> = dyn FnMut(&[Nodal], &mut [Nodal]) + 'a;

/// A linear system without its right-hand side; vectors are zero in constrained values.
pub(super) struct System<'a> {
    pub(super) apply: &'a mut Map<'a>,
    pub(super) precondition: &'a mut Map<'a>,
    /// 1/|A_ii|, the weight of the norm in which residuals are measured, so that forces and damage
    /// count alike.
    pub(super) weight: &'a [Nodal],
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
pub(super) fn solve(
    system: &mut System,
    definite: &mut bool,
    right: &[Nodal],
    x: &mut [Nodal],
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

fn conjugate_gradients(
    system: &mut System,
    right: &[Nodal],
    x: &mut [Nodal],
    tolerance: f64,
    limit: u32,
) -> Ending {
    let n = right.len();
    x.fill([0.0; 4]);
    let mut r = right.to_vec();
    let (mut z, mut p, mut q) = (vec![[0.0; 4]; n], vec![[0.0; 4]; n], vec![[0.0; 4]; n]);
    let size = weighted_dot(system.weight, &r, &r).sqrt();
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    if size == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    let (mut before, mut residual) = (0.0, 1.0);
    for iteration in 0..limit {
        (system.precondition)(&r, &mut z);
        let product = dot(&r, &z);
        if !product.is_finite() {
            return ending(Stop::Broken, iteration, residual);
        }
        if product <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        scale_and_add(&mut p, if iteration == 0 { 0.0 } else { product / before }, &z);
        (system.apply)(&p, &mut q);
        let curvature = dot(&p, &q);
        if curvature <= 0.0 {
            return ending(Stop::Indefinite, iteration, residual);
        }
        let step = product / curvature;
        add_scaled(x, step, &p);
        add_scaled(&mut r, -step, &q);
        before = product;
        residual = weighted_dot(system.weight, &r, &r).sqrt() / size;
        if !residual.is_finite() {
            return ending(Stop::Broken, iteration + 1, residual);
        }
        if residual <= tolerance {
            return ending(Stop::Converged, iteration + 1, residual);
        }
    }
    ending(Stop::Limit, limit, residual)
}

fn gmres(
    system: &mut System,
    right: &[Nodal],
    x: &mut [Nodal],
    tolerance: f64,
    limit: u32,
) -> Ending {
    let n = right.len();
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    x.fill([0.0; 4]);
    let mut r = right.to_vec();
    let size = weighted_dot(system.weight, &r, &r).sqrt();
    if size == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    let mut done = 0;
    let mut norm = size;
    while done < limit {
        let rounds = RESTART.min((limit - done) as usize);
        let mut basis = vec![scaled(&r, 1.0 / norm)];
        let mut directions: Vec<Vec<Nodal>> = Vec::new();
        let mut hessenberg: Vec<Vec<f64>> = Vec::new();
        let mut rotations: Vec<(f64, f64)> = Vec::new();
        let mut g = vec![norm];
        for j in 0..rounds {
            let mut z = vec![[0.0; 4]; n];
            (system.precondition)(&basis[j], &mut z);
            let mut w = vec![[0.0; 4]; n];
            (system.apply)(&z, &mut w);
            directions.push(z);
            let mut column = Vec::with_capacity(j + 2);
            for v in &basis {
                let h = weighted_dot(system.weight, v, &w);
                add_scaled(&mut w, -h, v);
                column.push(h);
            }
            let next = weighted_dot(system.weight, &w, &w).sqrt();
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
            basis.push(scaled(&w, 1.0 / next));
        }
        for (y, z) in back_substitution(&hessenberg, &g).into_iter().zip(&directions) {
            add_scaled(x, y, z);
        }
        (system.apply)(x, &mut r);
        scale_and_add(&mut r, -1.0, right);
        let reached = weighted_dot(system.weight, &r, &r).sqrt();
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

fn scaled(x: &[Nodal], a: f64) -> Vec<Nodal> {
    x.iter().map(|x| x.map(|v| a * v)).collect()
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
