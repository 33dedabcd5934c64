//! The expansion: sizes known at run time and at compile time, moments and Sobol indices, its file, its use in a model.

pub(crate) mod differentiable;
pub(crate) mod dyn_pce;
pub(crate) mod file;
pub(crate) mod kernel;
pub(crate) mod pce;
pub(crate) mod quadrature;
pub(crate) mod sobol;
