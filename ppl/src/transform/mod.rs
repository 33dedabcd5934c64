//! Maps between constrained values and unconstrained coordinates, with their log-Jacobians.
//!
//! | map | values | construction |
//! |---|---|---|
//! | [`Support`] | an interval of ℝ, open or bounded | exponential, logistic |
//! | [`Ascending`] | ordered values in an interval: ordered, positive-ordered, … | gaps: exponential, stick-breaking |
//! | [`Simplex`] | positive, sum 1 | softmax of a zero-sum vector (inverse isometric log-ratio) |
//!
//! Factors of correlation matrices have theirs in [`LkjCholesky`](crate::LkjCholesky).
//!
//! Nothing is clamped: where a value leaves the range of numbers, it is infinite or NaN, and so
//! is a density there, which rejects the point.

mod ascending;
mod simplex;
mod support;

use crate::scalar::Scalar;

pub use ascending::Ascending;
pub use simplex::Simplex;
pub(crate) use simplex::ln_simplex;
pub use support::Support;
pub(crate) use support::log_logistic_density;

/// A smooth map of unconstrained coordinates onto a set of vectors.
///
/// # Example
/// ```
/// use ppl::transform::{Simplex, VectorMap};
///
/// let coordinates = [0.3, -1.2];
/// let mut next = coordinates.iter().copied();
/// let mut shares = [0.0; 3];
/// let log_jacobian: f64 = Simplex.constrain(&mut || next.next().unwrap(), &mut shares);
/// assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15);
/// assert!(log_jacobian < 0.0);
///
/// let mut back = Vec::new();
/// Simplex.unconstrain(&shares, &mut back);
/// assert!(back.iter().zip(coordinates).all(|(b, c)| (b - c).abs() < 1e-14));
/// ```
pub trait VectorMap<R: Scalar> {
    /// Number of coordinates of a vector of length `n`.
    fn dim(&self, n: usize) -> usize;

    /// Fills `x` from the next coordinates and returns the log-Jacobian: of the free entries of
    /// `x`, where it has fewer of them than entries.
    fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R;

    /// Appends the coordinates of `x`; infinite on the boundary of the set.
    fn unconstrain(&self, x: &[R], out: &mut Vec<f64>);
}
