//! Posterior of the coefficients: intervals, and points at which further runs reduce the variance.

pub(crate) mod intervals;
pub(crate) mod placement;
pub(crate) mod posterior;
