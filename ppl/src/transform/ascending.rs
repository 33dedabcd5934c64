//! Ordered values.

use super::{Support, VectorMap, log_logistic_density};
use crate::scalar::Scalar;

/// Values x₁ < x₂ < … < xₙ inside a support.
///
/// | support | map | log-Jacobian |
/// |---|---|---|
/// | `Real` | x₁ = y₁, xᵢ = xᵢ₋₁ + exp yᵢ | Σ yᵢ, i from 2 |
/// | `Above(a)` | x₀ = a, xᵢ = xᵢ₋₁ + exp yᵢ | Σ yᵢ |
/// | `Below(b)` | the same downwards from b: the first coordinate belongs to xₙ | Σ yᵢ |
/// | `Between(a, b)` | x₀ = a, xᵢ = xᵢ₋₁ + (b − xᵢ₋₁) σ(yᵢ − ln(n − i + 1)) | Σ [ln(b − xᵢ₋₁) + ln σ + ln(1 − σ)] |
///
/// `Above(0)` gives positive-ordered values. Between two ends a stick is broken, centred so
/// that y = 0 spaces the values evenly.
///
/// # References
/// Stan Reference Manual, "Constraint Transforms", ordered vector and unit simplex.
#[derive(Clone, Copy, Debug)]
pub struct Ascending<R>(pub Support<R>);

/// The share of the stick that the `i`-th of `n` breaks takes at y = 0 is 1/(n − i + 1).
fn centre(i: usize, n: usize) -> f64 {
    ((n - i) as f64).ln()
}

impl<R: Scalar> VectorMap<R> for Ascending<R> {
    fn dim(&self, n: usize) -> usize {
        n
    }

    fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        let n = x.len();
        let mut log_jacobian = R::from(0.0);
        match self.0 {
            Support::Real => {
                let mut before = None;
                for x in x {
                    let y = next();
                    *x = match before {
                        None => y,
                        Some(before) => {
                            log_jacobian += y;
                            y.exp() + before
                        }
                    };
                    before = Some(*x);
                }
            }
            Support::Above(mut end) => {
                for x in x {
                    let y = next();
                    log_jacobian += y;
                    end += y.exp();
                    *x = end;
                }
            }
            Support::Below(mut end) => {
                for x in x.iter_mut().rev() {
                    let y = next();
                    log_jacobian += y;
                    end -= y.exp();
                    *x = end;
                }
            }
            Support::Between(a, b) => {
                let mut rest = b - a;
                let mut ln_rest = rest.ln();
                let mut taken = R::from(0.0);
                for (i, x) in x.iter_mut().enumerate() {
                    let y = next() - centre(i, n);
                    let (value, slope) = log_logistic_density(y.value(), |x| -x.ln());
                    log_jacobian += ln_rest + y.unary(value, slope);
                    taken += rest * y.logistic();
                    rest *= (-y).logistic();
                    ln_rest -= y.softplus();
                    // measured from the nearer end, so that both keep their digits
                    *x = if taken < rest { a + taken } else { b - rest };
                }
            }
        }
        log_jacobian
    }

    fn unconstrain(&self, x: &[R], out: &mut Vec<f64>) {
        let n = x.len();
        let at = |i: usize| x[i].value();
        match self.0 {
            Support::Real => {
                out.extend((0..n).map(|i| if i == 0 { at(0) } else { (at(i) - at(i - 1)).ln() }));
            }
            Support::Above(a) => {
                let before = |i: usize| if i == 0 { a.value() } else { at(i - 1) };
                out.extend((0..n).map(|i| (at(i) - before(i)).ln()));
            }
            Support::Below(b) => {
                let after = |i: usize| if i + 1 == n { b.value() } else { at(i + 1) };
                out.extend((0..n).rev().map(|i| (after(i) - at(i)).ln()));
            }
            Support::Between(a, b) => {
                let before = |i: usize| if i == 0 { a.value() } else { at(i - 1) };
                out.extend(
                    (0..n).map(|i| ((at(i) - before(i)) / (b.value() - at(i))).ln() + centre(i, n)),
                );
            }
        }
    }
}
