//! Samplers without gradients: random walks and delayed acceptance.

pub(crate) mod delayed;
pub(crate) mod delayed_kernel;
pub(crate) mod metropolis;
pub(crate) mod proposal;
pub(crate) mod screening;
pub(crate) mod tuning;
