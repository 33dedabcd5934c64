//! Maps between constrained values and unconstrained coordinates, with their log-Jacobians.
//!
//! | map | values | construction |
//! |---|---|---|
//! | [`Support`] | an interval of ℝ, open or bounded | exponential, logistic |
//! | [`Ascending`] | ordered values in an interval | ordered coordinates of the interval, by exponential gaps |
//! | [`Simplex`] | shares whose sum is 1 | stick-breaking |
//!
//! [`Domain`] and [`SmoothDomain`] are the traits of sets of values; a user-defined distribution names its set
//! of values, the domain.
//!
//! [`LkjCholesky`](crate::LkjCholesky) documents the map of the Cholesky factors of correlation matrices.
//!
//! Values are not clamped: a value that overflows is infinite or NaN. The density of such a value is not finite, so
//! that the point is rejected.

mod ascending;
mod domain;
mod simplex;
mod support;

pub use ascending::Ascending;
pub use domain::{Domain, SmoothDomain};
pub use simplex::Simplex;
pub use support::Support;
pub(crate) use support::log_logistic_density;
