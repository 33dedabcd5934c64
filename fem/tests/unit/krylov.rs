//! Krylov methods on small dense matrices.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::solve::linear::vector::{InMemory, Nodal};

type Method = fn(&mut System<InMemory>, &[Nodal], &mut [Nodal], f64, u32) -> Ending;

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
    let mut system = System {
        vectors: &InMemory::default(),
        apply: &mut apply,
        precondition: &mut precondition,
        weight: &weight,
    };
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
    let cases: [(&str, Method, &[Vec<f64>]); 4] = [
        ("CG", conjugate_gradients, &definite),
        ("GMRES", gmres, &definite),
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
    let (ending, error) = solve(gmres, &a, 2);
    assert_eq!((ending.stop, ending.iterations), (Stop::Converged, 2));
    assert!(error < 1e-12, "{error}");
}
