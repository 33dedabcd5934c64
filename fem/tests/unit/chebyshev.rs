//! The bound of the eigenvalues that the smoother acts on.

use super::*;

/// The bound of a diagonal matrix on 30 000 nodes whose eigenvalues fill (0, 1] but for one.
fn bound(apart: f64) -> f64 {
    let nodes = 30_000;
    let value = |node: usize| match node {
        4321 => apart,
        _ => ((node as f64) * 0.618).fract(),
    };
    // D is 4, so that A is four times as large
    let subtract = |x: &[[f64; 1]], y: &mut [[f64; 1]]| {
        y.iter_mut().zip(x).enumerate().for_each(|(n, (y, x))| y[0] -= 4.0 * value(n) * x[0]);
    };
    largest_eigenvalue(&Halo::default(), nodes, subtract, |_, r| [0.25 * r[0]])
}

#[test]
fn an_eigenvalue_apart_from_the_others_is_found() {
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
