//! The Chebyshev smoother and its bound of the eigenvalues.

use super::*;
use crate::solve::linear::in_memory::InMemory;

/// Diagonal matrix A on 30 000 nodes. The eigenvalues of D⁻¹ A are evenly distributed in (0, 1], except one eigenvalue.
/// D is 4 I.
struct Diagonal {
    /// The eigenvalue outside (0, 1].
    apart: f64,
}

impl Diagonal {
    fn value(&self, node: usize) -> f64 {
        4.0 * if node == 4321 { self.apart } else { ((node as f64) * 0.618).fract() }
    }
}

impl Matrix for Diagonal {
    type Space = InMemory<f64, 1>;

    fn subtract(&mut self, x: &[[f64; 1]], y: &mut [[f64; 1]]) {
        y.iter_mut().zip(x).enumerate().for_each(|(n, (y, x))| y[0] -= self.value(n) * x[0]);
    }

    fn relax(
        &self,
        Relaxation { momentum, weight }: Relaxation,
        r: &[[f64; 1]],
        step: &mut [[f64; 1]],
        x: &mut [[f64; 1]],
    ) {
        for ((r, step), x) in r.iter().zip(step).zip(x) {
            step[0] = momentum * step[0] + weight * 0.25 * r[0];
            x[0] += step[0];
        }
    }
}

/// Returns the bound of the eigenvalues of D⁻¹ A for this exceptional eigenvalue.
fn bound(apart: f64) -> f64 {
    largest_eigenvalue(&InMemory::default(), &mut Diagonal { apart }, &[[0.0]; 30_000])
}

#[test]
fn smoothing_reduces_the_residual_by_the_chebyshev_polynomial() {
    // smoothing reduces components with eigenvalues above a tenth of the largest eigenvalue to at most 1/T_3(11/9) of
    // their initial residual
    let (mut matrix, vectors) = (Diagonal { apart: 1.0 }, InMemory::default());
    let right: Vec<[f64; 1]> =
        (0..30_000).map(|n| [f64::from(u8::from(matrix.value(n) >= 0.4))]).collect();
    let [mut x, mut residual] = [vec![[0.0]; right.len()], right.clone()];
    let mut smoother = Smoother::new(3, 1.0, vectors.zero(&right));
    smoother.smooth(&mut matrix, &mut residual, &mut x);
    residual.clone_from(&right);
    matrix.subtract(&x, &mut residual);
    let chebyshev = |x: f64| 4.0 * x * x * x - 3.0 * x;
    let reached = residual.iter().fold(0.0f64, |m, r| m.max(r[0].abs()));
    let expected = 1.0 / chebyshev(11.0 / 9.0);
    assert!((reached / expected - 1.0).abs() < 1e-3, "{reached} {expected}");
}

#[test]
fn the_bound_includes_an_isolated_largest_eigenvalue() {
    for apart in [1.0, 1.5, 3.0, 40.0] {
        let bound = bound(apart);
        assert!(bound >= apart && bound <= 1.0001 * MARGIN * apart, "{apart}: {bound}");
    }
}

#[test]
fn threads_do_not_change_the_bound() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| bound(1.2))
    };
    assert!(with(1) == with(2) && with(1) == with(3));
}
