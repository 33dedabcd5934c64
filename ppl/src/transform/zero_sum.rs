//! Vectors that sum to zero.

use super::VectorMap;
use crate::scalar::Scalar;

/// Vectors of n numbers with sum 0, from n − 1 coordinates.
///
/// x = Q y with an orthonormal Q: its column k = 1 … n − 1 is (1, …, 1, −k, 0, …, 0)/√(k(k + 1))
/// with k ones (Helmert). Lengths and volumes are kept, so log|J| = 0, and independent standard
/// normal coordinates give a normal vector with covariance I − 1/n.
///
/// # References
/// Stan Reference Manual, "Constraint Transforms", zero-sum vector.
#[derive(Clone, Copy, Debug)]
pub struct ZeroSum;

impl<R: Scalar> VectorMap<R> for ZeroSum {
    fn dim(&self, n: usize) -> usize {
        n.saturating_sub(1)
    }

    fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        from_coordinates(next, x);
        R::from(0.0)
    }

    fn unconstrain(&self, x: &[R], out: &mut Vec<f64>) {
        to_coordinates(x.len(), |i| x[i].value(), out);
    }
}

/// Length of the Helmert column k before it is normalised.
fn length(k: usize) -> f64 {
    ((k * (k + 1)) as f64).sqrt()
}

/// x = Q y, in place: the coordinates pass through the entries that they end in.
pub(super) fn from_coordinates<R: Scalar>(next: &mut impl FnMut() -> R, x: &mut [R]) {
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
pub(super) fn to_coordinates(n: usize, x: impl Fn(usize) -> f64, out: &mut Vec<f64>) {
    let mut sum = 0.0;
    for k in 1..n {
        sum += x(k - 1);
        out.push((sum - k as f64 * x(k)) / length(k));
    }
}
