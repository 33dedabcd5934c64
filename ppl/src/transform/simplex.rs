//! The unit simplex.

use super::VectorMap;
use crate::scalar::Scalar;

/// Vectors of n positive numbers with sum 1, from n − 1 coordinates.
///
/// The inverse isometric log-ratio map: x = softmax z with z = Q y, which sums to 0, and an
/// orthonormal Q whose column k = 1 … n − 1 is (1, …, 1, −k, 0, …, 0)/√(k(k + 1)) with k ones
/// (Helmert), so that no entry is treated unlike the others and y = 0 is the centre. In terms
/// of n − 1 of the entries, log|J| = Σ ln xᵢ + ½ ln n.
///
/// # References
/// Egozcue, Pawlowsky-Glahn, Mateu-Figueras & Barceló-Vidal (2003), *Isometric Logratio
/// Transformations for Compositional Data Analysis*, doi:10.1023/A:1023818214614.
#[derive(Clone, Copy, Debug)]
pub struct Simplex;

impl<R: Scalar> VectorMap<R> for Simplex {
    fn dim(&self, n: usize) -> usize {
        n.saturating_sub(1)
    }

    fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        ln_simplex(next, x);
        let log_jacobian = x.iter().copied().sum::<R>() + 0.5 * (x.len() as f64).ln();
        x.iter_mut().for_each(|x| *x = x.exp());
        log_jacobian
    }

    fn unconstrain(&self, x: &[R], out: &mut Vec<f64>) {
        to_coordinates(x.len(), |i| x[i].value().ln(), out);
    }
}

/// The logarithms of the entries: they stay finite where entries vanish.
pub(crate) fn ln_simplex<R: Scalar>(next: &mut impl FnMut() -> R, x: &mut [R]) {
    from_coordinates(next, x);
    let total = ln_sum_exp(x);
    x.iter_mut().for_each(|x| *x -= total);
}

/// ln Σ exp xᵢ.
fn ln_sum_exp<R: Scalar>(x: &[R]) -> R {
    let largest = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(x.value()));
    let terms = || x.iter().map(|&x| (x, (x.value() - largest).exp()));
    let sum: f64 = terms().map(|(_, e)| e).sum();
    R::fuse_iter(largest + sum.ln(), terms().map(|(x, e)| (x, e / sum)))
}

/// Length of the Helmert column k before it is normalised.
fn length(k: usize) -> f64 {
    ((k * (k + 1)) as f64).sqrt()
}

/// x = Q y, in place: the coordinates pass through the entries that they end in.
fn from_coordinates<R: Scalar>(next: &mut impl FnMut() -> R, x: &mut [R]) {
    let Some((first, rest)) = x.split_first_mut() else { return };
    rest.iter_mut().for_each(|x| *x = next());
    // Σ of the columns to the right, which have ones here
    let mut sum = R::from(0.0);
    for (k, x) in rest.iter_mut().enumerate().rev() {
        let k = k + 1;
        let weight = *x / length(k);
        *x = sum - weight * k as f64;
        sum += weight;
    }
    *first = sum;
}

/// y = Qᵀ x.
fn to_coordinates(n: usize, x: impl Fn(usize) -> f64, out: &mut Vec<f64>) {
    let mut sum = 0.0;
    for k in 1..n {
        sum += x(k - 1);
        out.push((sum - k as f64 * x(k)) / length(k));
    }
}
