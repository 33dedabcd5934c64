//! User-defined functions with derivatives.

pub(crate) mod differentiable;
pub(crate) mod finite_difference;
pub(crate) mod ode;
