//! Runs of a sampler: settings, starting points, chains in parallel, progress, resumption, errors.

pub(crate) mod chains;
pub(crate) mod error;
pub(crate) mod kernel;
pub(crate) mod mcmc;
pub(crate) mod progress;
pub(crate) mod rejections;
pub(crate) mod resume;
pub(crate) mod settings;
pub(crate) mod stop;
pub(crate) mod stream;
