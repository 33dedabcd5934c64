//! Maps between constrained values and unconstrained coordinates, with their log-Jacobians.

mod support;

pub use support::Support;
pub(crate) use support::log_logistic_density;
