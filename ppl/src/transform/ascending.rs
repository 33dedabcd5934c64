//! Map of ordered values.

use super::Support;
use crate::number::scalar::Scalar;
use crate::term::accumulator::{Accumulator, Joined};

/// Ordered values x₁ < x₂ < … < xₙ inside a support.
///
/// The map of the [`Support`] assigns to the values the coordinates u₁, u₂, …, which are ordered too (in reverse
/// order for `Support::Below`). The ordered coordinates are computed from unconstrained coordinates y by u₁ = y₁ and
/// uᵢ = uᵢ₋₁ + exp yᵢ. The log-Jacobian is Σ yᵢ, with i from 2, plus the log-Jacobian of the support.
///
/// # Example
/// ```
/// use ppl::transform::{Ascending, Support};
///
/// let (mut coordinates, mut x) = ([0.3, -1.2].into_iter(), [0.0; 2]);
/// let map = Ascending(Support::Real);
/// let log_jacobian: f64 = map.constrain(&mut || coordinates.next().unwrap(), &mut x);
/// assert_eq!((x, log_jacobian), ([0.3, 0.3 + (-1.2f64).exp()], -1.2));
/// ```
///
/// # References
/// Stan Reference Manual, "Constraint Transforms", ordered vector.
#[derive(Clone, Copy, Debug)]
pub struct Ascending<R>(pub Support<R>);

impl<R: Scalar> Ascending<R> {
    /// Fills `x` from the next coordinates, and returns the log-Jacobian.
    pub fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        let mut last = None;
        let ((), log_jacobian) = Joined::with(|terms| {
            for x in x.iter_mut() {
                let y = next();
                let u = last.map_or(y, |last| y.exp() + last);
                if last.is_some() {
                    terms.add_number(y);
                }
                last = Some(u);
                *x = self.0.constrain_last_use(u, terms);
            }
        });
        if let Support::Below(_) = self.0 {
            x.reverse();
        }
        log_jacobian
    }

    /// Appends the coordinates of `x`. A coordinate is infinite if two values are equal, or if a value is at an end of
    /// the support.
    pub fn unconstrain(&self, x: &[R], out: &mut Vec<f64>) {
        let mut u: Vec<f64> = x.iter().map(|x| self.0.unconstrain(x.value())).collect();
        if let Support::Below(_) = self.0 {
            u.reverse();
        }
        out.extend((0..u.len()).map(|i| if i == 0 { u[0] } else { (u[i] - u[i - 1]).ln() }));
    }
}
