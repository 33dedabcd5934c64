//! The simplex: positive shares whose sum is 1.

use super::domain::{Domain, SmoothDomain};
use crate::number::scalar::Scalar;

/// Largest distance of the sum of the shares of a datum from 1.
const ROUNDING: f64 = 1e-8;

/// Simplex of K shares, xₖ > 0 with Σ xₖ = 1.
///
/// The map from K − 1 coordinates y breaks a stick of length 1: zₖ = σ(yₖ − ln(K − 1 − k)) is the fraction of the
/// remaining stick that share k takes, for k = 0, …, K − 2, and the last share is the rest. At y = 0 all shares are
/// 1/K. The log-Jacobian belongs to the first K − 1 shares and is Σₖ [ln zₖ + ln(1 − zₖ) + ln restₖ]. The map is
/// computed with logarithms, so that shares far below 1e-300 have finite log densities.
///
/// # References
/// Stan Reference Manual, "Unit simplex".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Simplex<const K: usize>;

impl<const K: usize> Simplex<K> {
    /// Maps the next K − 1 coordinates to the logarithms of the shares. Returns the logarithms and the log-Jacobian.
    pub(crate) fn ln_shares<R: Scalar>(next: &mut impl FnMut() -> R) -> ([R; K], R) {
        let (mut ln_rest, mut log_jacobian) = (R::from(0.0), R::from(0.0));
        let ln_shares = std::array::from_fn(|k| {
            if k + 1 == K {
                return ln_rest;
            }
            let y = next() - ((K - 1 - k) as f64).ln();
            let (ln_taken, ln_left) = (-(-y).softplus(), -y.softplus());
            log_jacobian += ln_taken + ln_left + ln_rest;
            let ln_share = ln_rest + ln_taken;
            ln_rest += ln_left;
            ln_share
        });
        (ln_shares, log_jacobian)
    }
}

impl<R: Scalar, const K: usize> Domain<R> for Simplex<K> {
    type Value = [R; K];

    fn includes(&self, x: &[R; K]) -> bool {
        let sum: f64 = x.iter().map(|x| x.value()).sum();
        x.iter().all(|x| x.value() >= 0.0) && (sum - 1.0).abs() <= ROUNDING
    }
}

impl<R: Scalar, const K: usize> SmoothDomain<R> for Simplex<K> {
    fn dim(&self) -> usize {
        K.saturating_sub(1)
    }

    fn value_at(&self, next: &mut impl FnMut() -> R) -> ([R; K], R) {
        let (ln_shares, log_jacobian) = Self::ln_shares(next);
        (ln_shares.map(Scalar::exp), log_jacobian)
    }

    fn coordinates_of(&self, x: &[R; K], out: &mut Vec<f64>) {
        // sums from the end, because 1 − x₀ − x₁ − … loses the digits of small shares
        let mut rest: [f64; K] = x.map(|x| x.value());
        for k in (1..K).rev() {
            rest[k - 1] += rest[k];
        }
        for k in 0..K.saturating_sub(1) {
            out.push((x[k].value() / rest[k + 1]).ln() + ((K - 1 - k) as f64).ln());
        }
    }
}
