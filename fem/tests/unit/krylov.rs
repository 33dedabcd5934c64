//! Krylov methods on small dense matrices.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::solve::linear::in_memory::{Nodal, NodalVectors};

type Method = fn(&mut System<NodalVectors>, &[Nodal], &mut [Nodal], f64, u32) -> Ending;

fn from_zero(
    system: &mut System<NodalVectors>,
    right: &[Nodal],
    x: &mut [Nodal],
    tolerance: f64,
    limit: u32,
) -> Ending {
    gmres(system, right, x, Start::Zero, tolerance, limit)
}

/// Dense matrix with the given diagonal, plus a random symmetric and a random skew-symmetric matrix of these sizes.
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
    solve_to(method, a, 1e-11, limit)
}

/// Dense matrix with its diagonal as preconditioner.
struct Dense<'a> {
    a: &'a [Vec<f64>],
    weight: &'a [Nodal],
}

impl Dense<'_> {
    fn product(&self, x: &[f64]) -> Vec<f64> {
        self.a.iter().map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
    }
}

impl Preconditioned<NodalVectors> for Dense<'_> {
    fn apply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        y.as_flattened_mut().copy_from_slice(&self.product(x.as_flattened()));
    }

    fn precondition(&mut self, r: &[Nodal], z: &mut [Nodal]) {
        for ((z, r), w) in z.iter_mut().zip(r).zip(self.weight) {
            *z = std::array::from_fn(|k| w[k] * r[k]);
        }
    }
}

fn solve_to(method: Method, a: &[Vec<f64>], tolerance: f64, limit: u32) -> (Ending, f64) {
    let n = a.len() / 4;
    let exact: Vec<f64> = (0..4 * n).map(|i| (0.3 * i as f64).cos()).collect();
    let weight: Vec<Nodal> = (0..n)
        .map(|node| std::array::from_fn(|k| 1.0 / a[4 * node + k][4 * node + k].abs()))
        .collect();
    let mut matrix = Dense { a, weight: &weight };
    let right: Vec<Nodal> = matrix.product(&exact).as_chunks().0.to_vec();
    let mut x = vec![[0.0; 4]; n];
    let mut system =
        System { vectors: &NodalVectors::default(), matrix: &mut matrix, weight: &weight };
    let ending = method(&mut system, &right, &mut x, tolerance, limit);
    let error = x.as_flattened().iter().zip(&exact).map(|(x, e)| (x - e).abs());
    (ending, error.fold(0.0, f64::max))
}

#[test]
fn each_method_solves_its_class_of_matrices() {
    let n = 60;
    let positive: Vec<f64> = (0..n).map(|i| 4.0 + f64::from(i)).collect();
    let mixed: Vec<f64> =
        positive.iter().enumerate().map(|(i, d)| if i % 5 == 0 { -d } else { *d }).collect();
    let definite = matrix(&positive, 0.15, 0.0);
    let indefinite = matrix(&mixed, 0.15, 0.0);
    let unsymmetric = matrix(&mixed, 0.15, 0.3);
    let cases: [(&str, Method, &[Vec<f64>]); 4] = [
        ("CG", conjugate_gradients, &definite),
        ("GMRES", from_zero, &definite),
        ("GMRES", from_zero, &indefinite),
        ("GMRES", from_zero, &unsymmetric),
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
fn gmres_needs_one_step_per_distinct_eigenvalue() {
    let diagonal: Vec<f64> = (0..40).map(|i| [1.0, 2.0, -3.0][i % 3]).collect();
    let a = matrix(&diagonal, 0.0, 0.0);
    // the matrix A, preconditioned by |A|, has the eigenvalues 1 and −1
    let (ending, error) = solve(from_zero, &a, 2);
    assert_eq!((ending.stop, ending.iterations), (Stop::Converged, 2));
    assert!(error < 1e-12, "{error}");
}

#[test]
fn a_gmres_basis_in_single_precision_needs_no_additional_iterations() {
    let diagonal: Vec<f64> =
        (0..60).map(|i| if i % 5 == 0 { -1.0 } else { 1.0 } * (4.0 + f64::from(i))).collect();
    let a = matrix(&diagonal, 0.15, 0.3);
    // the smallest tolerance with single precision, and a slightly smaller tolerance, with double precision
    let (short, _) = solve_to(from_zero, &a, COARSE, 200);
    let (whole, _) = solve_to(from_zero, &a, (1.0 - 1e-9) * COARSE, 200);
    assert_eq!(short.stop, Stop::Converged, "{short:?}");
    assert!(short.residual <= COARSE && short.iterations > 5, "{short:?}");
    assert_eq!(short.iterations, whole.iterations);
    // the residuals differ only by the rounding of the basis to single precision
    let difference = (short.residual / whole.residual - 1.0).abs();
    assert!(difference > 0.0 && difference < 1e-3, "{short:?} {whole:?}");
}

#[test]
fn gmres_continues_after_negative_curvature_in_conjugate_gradients() {
    let diagonal: Vec<f64> =
        (0..60).map(|i| if i == 7 { -4.0 } else { 4.0 + f64::from(i) }).collect();
    let a = matrix(&diagonal, 0.15, 0.0);
    let both: Method = |system, right, x, tolerance, limit| {
        super::solve(system, &mut true, right, x, tolerance, limit)
    };
    let (ending, error) = solve(both, &a, 200);
    assert_eq!(ending.stop, Stop::Converged, "{ending:?}");
    assert!(error < 1e-9, "{error}");
    // GMRES starts from the solution that conjugate gradients have reached
    let (stopped, _) = solve(conjugate_gradients, &a, 200);
    let (alone, _) = solve(from_zero, &a, 200);
    assert_eq!(stopped.stop, Stop::Indefinite);
    assert!(ending.iterations <= stopped.iterations + alone.iterations, "{ending:?} {alone:?}");
}
