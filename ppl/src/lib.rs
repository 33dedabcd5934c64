//! Probabilistic programming in Rust.

extern crate self as ppl;

mod bound;
pub mod check;
mod collect;
mod density;
pub mod diagnostics;
mod differentiable;
mod distribution;
mod dual;
mod export;
mod findings;
mod group;
mod model;
mod optimize;
mod posterior;
mod reading;
mod real;
mod record;
mod sampler;
mod scalar;
pub mod special;
mod summary;
pub mod tape;
mod trace;
pub mod transform;

pub use bound::{Bound, Layout, ModelError, Workspace};
pub use density::{DomainError, LogDensity, Place, Rejection};
pub use differentiable::{Differentiable, Forward, Generic};
pub use distribution::*;
pub use dual::Dual;
pub use findings::{Finding, FindingKind};
pub use group::{Group, Values};
pub use model::{Context, Failure, Model, Site};
pub use optimize::{Laplace, Map, Mode, OptimizeError};
pub use posterior::{DivergentPoint, Posterior, PosteriorError};
pub use ppl_macros::model;
pub use rand;
pub use real::Real;
pub use record::{Datum, Record as Recordable};
pub use sampler::{
    Chain, ChainStatus, Chains, Covariance, Divergence, DrawStats, Metropolis, Nuts, Progress,
    SampleError, WarmupReport,
};
pub use scalar::{Arithmetic, Scalar};
pub use summary::{Summary, SummaryRow};
pub use trace::{Entry, Record, Role, Variable};

/// The language of models: distributions, their variations, and what expressions need.
pub mod prelude {
    pub use crate::differentiable::Differentiable;
    pub use crate::distribution::*;
    pub use crate::optimize::Map;
    pub use crate::sampler::{Metropolis, Nuts};
    pub use crate::scalar::Scalar;
    pub use crate::{LogDensity, Real, model};
}

/// What generated code calls. Not public interface.
#[doc(hidden)]
pub mod __private {
    pub use crate::distribution::{constrain, ln_density};
}
