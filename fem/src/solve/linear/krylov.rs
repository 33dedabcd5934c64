//! Krylov methods on nodal vectors, each started from zero.
//!
//! - conjugate gradients: symmetric positive definite (Hestenes & Stiefel 1952,
//!   doi:10.6028/jres.049.044);
//! - MINRES: symmetric indefinite, with a positive definite preconditioner (Paige & Saunders 1975,
//!   doi:10.1137/0712047);
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
    /// Relative to the right-hand side, in the weighted norm (MINRES: of the preconditioner).
    pub(super) residual: f64,
}

/// Iterations between restarts of GMRES.
const RESTART: usize = 40;

pub(super) fn conjugate_gradients(
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

pub(super) fn minres(
    system: &mut System,
    right: &[Nodal],
    x: &mut [Nodal],
    tolerance: f64,
    limit: u32,
) -> Ending {
    let n = right.len();
    let zero = || vec![[0.0; 4]; n];
    let ending = |stop, iterations, residual| Ending { stop, iterations, residual };
    x.fill([0.0; 4]);
    // v: Lanczos vectors; z = M⁻¹ v; w: directions of the solution
    let (mut v_old, mut v, mut v_new) = (zero(), right.to_vec(), zero());
    let (mut z, mut z_new) = (zero(), zero());
    let (mut w_old, mut w, mut w_new) = (zero(), zero(), zero());
    (system.precondition)(&v, &mut z);
    let square = dot(&v, &z);
    if square == 0.0 {
        return ending(Stop::Converged, 0, 0.0);
    }
    if square.is_nan() || square < 0.0 {
        return ending(Stop::Indefinite, 0, 1.0);
    }
    let size = square.sqrt();
    let (mut beta_old, mut beta, mut eta) = (1.0, size, size);
    let (mut cos_old, mut cos, mut sin_old, mut sin) = (1.0, 1.0, 0.0, 0.0);
    for iteration in 1..=limit {
        z.iter_mut().flatten().for_each(|z| *z /= beta);
        (system.apply)(&z, &mut v_new);
        let alpha = dot(&v_new, &z);
        add_scaled(&mut v_new, -alpha / beta, &v);
        if iteration > 1 {
            add_scaled(&mut v_new, -beta / beta_old, &v_old);
        }
        (system.precondition)(&v_new, &mut z_new);
        let square = dot(&v_new, &z_new);
        if !square.is_finite() || !alpha.is_finite() {
            return ending(Stop::Broken, iteration, eta.abs() / size);
        }
        // round-off alone makes the square of a vanishing Lanczos vector negative
        if square < -1e-12 * size * size {
            return ending(Stop::Indefinite, iteration, eta.abs() / size);
        }
        let beta_new = square.max(0.0).sqrt();
        let diagonal = cos * alpha - cos_old * sin * beta;
        let rho = diagonal.hypot(beta_new);
        let above = sin * alpha + cos_old * cos * beta;
        let second = sin_old * beta;
        if rho == 0.0 {
            return ending(Stop::Broken, iteration, eta.abs() / size);
        }
        (cos_old, sin_old) = (cos, sin);
        (cos, sin) = (diagonal / rho, beta_new / rho);
        w_new.copy_from_slice(&z);
        add_scaled(&mut w_new, -second, &w_old);
        add_scaled(&mut w_new, -above, &w);
        w_new.iter_mut().flatten().for_each(|w| *w /= rho);
        add_scaled(x, cos * eta, &w_new);
        eta *= -sin;
        (beta_old, beta) = (beta, beta_new);
        std::mem::swap(&mut v_old, &mut v);
        std::mem::swap(&mut v, &mut v_new);
        std::mem::swap(&mut z, &mut z_new);
        std::mem::swap(&mut w_old, &mut w);
        std::mem::swap(&mut w, &mut w_new);
        if eta.abs() <= tolerance * size || beta == 0.0 {
            return ending(Stop::Converged, iteration, eta.abs() / size);
        }
    }
    ending(Stop::Limit, limit, eta.abs() / size)
}

pub(super) fn gmres(
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
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    type Method = fn(&mut System, &[Nodal], &mut [Nodal], f64, u32) -> Ending;

    /// A dense matrix with the given diagonal, a random symmetric rest and a random skew part.
    fn matrix(diagonal: &[f64], symmetric: f64, skew: f64) -> Vec<Vec<f64>> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let n = diagonal.len();
        let mut a = vec![vec![0.0; n]; n];
        for i in 0..n {
            a[i][i] = diagonal[i];
            for j in 0..i {
                let (s, t): (f64, f64) = (rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0));
                a[i][j] = symmetric * s + skew * t;
                a[j][i] = symmetric * s - skew * t;
            }
        }
        a
    }

    fn solve(method: Method, a: &[Vec<f64>], limit: u32) -> (Ending, f64) {
        let n = a.len() / 4;
        let exact: Vec<f64> = (0..4 * n).map(|i| (0.3 * i as f64).cos()).collect();
        let product = |x: &[f64]| -> Vec<f64> {
            a.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
        };
        let right: Vec<Nodal> = product(&exact).as_chunks().0.to_vec();
        let weight: Vec<Nodal> = (0..n)
            .map(|node| std::array::from_fn(|k| 1.0 / a[4 * node + k][4 * node + k].abs()))
            .collect();
        let mut x = vec![[0.0; 4]; n];
        let mut apply = |x: &[Nodal], y: &mut [Nodal]| {
            y.as_flattened_mut().copy_from_slice(&product(x.as_flattened()))
        };
        let mut precondition = |x: &[Nodal], y: &mut [Nodal]| {
            for ((y, x), w) in y.iter_mut().zip(x).zip(&weight) {
                *y = std::array::from_fn(|k| w[k] * x[k]);
            }
        };
        let mut system =
            System { apply: &mut apply, precondition: &mut precondition, weight: &weight };
        let ending = method(&mut system, &right, &mut x, 1e-11, limit);
        let error = x.as_flattened().iter().zip(&exact).map(|(x, e)| (x - e).abs());
        (ending, error.fold(0.0, f64::max))
    }

    #[test]
    fn each_method_solves_the_matrices_it_is_for() {
        let n = 60;
        let positive: Vec<f64> = (0..n).map(|i| 4.0 + f64::from(i)).collect();
        let mixed: Vec<f64> =
            positive.iter().enumerate().map(|(i, d)| if i % 5 == 0 { -d } else { *d }).collect();
        let definite = matrix(&positive, 0.15, 0.0);
        let indefinite = matrix(&mixed, 0.15, 0.0);
        let unsymmetric = matrix(&mixed, 0.15, 0.3);
        let cases: [(&str, Method, &[Vec<f64>]); 6] = [
            ("CG", conjugate_gradients, &definite),
            ("MINRES", minres, &definite),
            ("GMRES", gmres, &definite),
            ("MINRES", minres, &indefinite),
            ("GMRES", gmres, &indefinite),
            ("GMRES", gmres, &unsymmetric),
        ];
        for (name, method, a) in cases {
            let (ending, error) = solve(method, a, 200);
            assert_eq!(ending.stop, Stop::Converged, "{name}: {ending:?}");
            assert!(error < 1e-9, "{name}: {error}");
        }
        let (ending, _) = solve(conjugate_gradients, &indefinite, 200);
        assert_eq!(ending.stop, Stop::Indefinite);
    }

    #[test]
    fn as_many_steps_as_distinct_eigenvalues_suffice() {
        let diagonal: Vec<f64> = (0..40).map(|i| [1.0, 2.0, -3.0][i % 3]).collect();
        let a = matrix(&diagonal, 0.0, 0.0);
        // preconditioned by |A|, the matrix has the eigenvalues 1 and -1
        for method in [minres as Method, gmres] {
            let (ending, error) = solve(method, &a, 2);
            assert_eq!((ending.stop, ending.iterations), (Stop::Converged, 2));
            assert!(error < 1e-12, "{error}");
        }
    }
}
