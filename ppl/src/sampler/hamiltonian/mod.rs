//! Hamiltonian dynamics: metrics, trajectories, step size, warmup.

pub(crate) mod dot;
pub(crate) mod metric;
pub(crate) mod step_size;
pub(crate) mod system;
pub(crate) mod trajectory;
pub(crate) mod warmup;
