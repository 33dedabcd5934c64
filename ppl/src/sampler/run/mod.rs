//! Runs of a sampler: chains in parallel, starting points, resumption, user-defined kernels.

pub(crate) mod chains;
pub(crate) mod kernel;
pub(crate) mod mcmc;
pub(crate) mod resume;
