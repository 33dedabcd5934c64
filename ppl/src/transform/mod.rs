//! Maps between constrained values and unconstrained coordinates, with their log-Jacobians.
//!
//! | map | values | construction |
//! |---|---|---|
//! | [`Support`] | an interval of ℝ, open or bounded | exponential, logistic |
//! | [`Ascending`] | ordered values in an interval | ordered coordinates of the interval, by exponential gaps |
//!
//! Factors of correlation matrices have theirs in [`LkjCholesky`](crate::LkjCholesky).
//!
//! Nothing is clamped: where a value leaves the range of numbers, it is infinite or NaN, and so
//! is a density there, which rejects the point.

mod ascending;
mod support;

pub use ascending::Ascending;
pub use support::Support;
pub(crate) use support::log_logistic_density;
