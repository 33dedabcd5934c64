//! Samplers that follow the gradient: trajectories, metrics, warmup, NUTS.

pub(crate) mod dot;
pub(crate) mod metric;
pub(crate) mod nuts;
pub(crate) mod step_size;
pub(crate) mod system;
pub(crate) mod trajectory;
pub(crate) mod warmup;
