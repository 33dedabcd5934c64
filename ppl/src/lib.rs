//! Probabilistic programming in Rust: write a model, condition it on data, sample its unknowns.
//!
//! A model is a function of its data, declared with [`model!`]. The language has one main rule: **`let x ~ D` declares
//! an unknown; `place ~ D` without `let` conditions on an existing value.** The page of [`model!`] is the reference.
//!
//! ```
//! use ppl::prelude::*;
//!
//! ppl::model! {
//!     /// A spring: force proportional to stretch, measured with an error of unknown size.
//!     pub fn spring(stretch_mm: &[f64], force_n: &[f64]) {
//!         let stiffness ~ LogNormal(0.0, 1.0); // N/mm
//!         let sd ~ HalfNormal(0.5); // N
//!         for (x, f) in stretch_mm.iter().zip(force_n) {
//!             f ~ Normal(stiffness * x, sd);
//!         }
//!         #[predict] let force_at_5_mm ~ Normal(stiffness * 5.0, sd);
//!     }
//! }
//!
//! let model = spring(&[1.0, 2.0, 3.0, 4.0], &[2.1, 3.9, 6.2, 7.9]);
//! let posterior = Nuts::default().chains(2).warmup(300).draws(300).seed(7).sample(&model)?;
//! println!("{}", posterior.summary());
//!
//! let stiffness = posterior.values("stiffness").expect("named in the model");
//! let mean = stiffness.data.iter().sum::<f64>() / stiffness.data.len() as f64;
//! assert!((mean - 2.0).abs() < 0.1);
//! # Ok::<(), ppl::SampleError>(())
//! ```
//!
//! The [`guide`] teaches the language in ten short pages.
//!
//! # Contents
//! - **Models**: declare them with [`model!`], or implement the trait [`Model`]; [`Bound`] is a model with its data.
//! - **Distributions**: one type per distribution, with the variations of [`Family`]: `.iid(n)`, `.array::<N>()`,
//!   `.truncate(a..b)`, `.ordered()`. User-defined distributions implement [`Distribution`].
//! - **Derivatives**: exact, by reverse mode. User-defined functions implement [`Differentiable`]; [`FiniteDifference`]
//!   differentiates black boxes.
//! - **Samplers**: [`Nuts`] uses gradients. [`Metropolis`] and [`DelayedAcceptance`] need no gradients;
//!   [`DelayedAcceptance`] screens proposals with a cheap density. All samplers accept models and other log
//!   densities. Chains run in parallel, with the same draws for any number of threads. [`Map`] finds joint modes,
//!   [`Laplace`] the normal approximation at a mode.
//! - **Results**: [`Posterior`] contains named draws with shapes. A posterior provides a summary, diagnostics with
//!   explanations, predictive checks, cross-validation, prior sensitivity, and export for ArviZ.
//! - **[`check`]**: statistical assertions for `cargo test`.
//!
//! # The order of the modules
//! A module imports only modules that precede it in this list.
//! 1. `density`, `site`, `group`, `coordinates`, `words`: common definitions
//! 2. `datum`, `record`, `layout`: values of a model, and their description for a posterior
//! 3. `special`, `arithmetic`, `partials`, `scalar`, `ln_sum_exp`: scalar types and functions
//! 4. `dual`, `tape`, `real`, `accumulator`: scalars with derivatives, and sums of log density terms
//! 5. `differentiable`, `finite_difference`, `parameter`, `literal`, `backend`, `transform`: user-defined functions,
//!    and maps from unconstrained to constrained values
//! 6. `distribution`: distributions, one family per file
//! 7. `expression`, `dot`, `plate_adjoint`, `operand`: types of the expressions in a model
//! 8. `model`, `submodel`, `evaluation`, `value_reader`, `trace`: traits behind `model!`, and the contexts that
//!    evaluate it
//! 9. `inspect`, `bound`, `erased`, `start`: a model with its data; type-erased models; starting points
//! 10. `optimize`, `sampler`: MAP and Laplace; NUTS and Metropolis
//! 11. `diagnostics`: convergence diagnostics
//! 12. `posterior`, `warnings`, `summary`: named draws, and their description
//! 13. `predictive`, `power_scaling`, `export`: replicated data, prior sensitivity, files
//! 14. `check`: assertions
//! 15. `guide`: ten pages

extern crate self as ppl;

mod accumulator;
mod arithmetic;
mod backend;
mod bound;
pub mod check;
mod coordinates;
mod datum;
mod density;
pub mod diagnostics;
mod differentiable;
mod distribution;
mod dot;
mod dual;
mod erased;
mod evaluation;
mod export;
mod expression;
mod finite_difference;
mod group;
pub mod guide;
mod inspect;
mod layout;
mod literal;
mod ln_sum_exp;
mod model;
mod operand;
mod optimize;
mod parameter;
mod partials;
mod plate_adjoint;
mod posterior;
mod power_scaling;
mod predictive;
mod real;
mod record;
mod sampler;
mod scalar;
mod site;
pub mod special;
mod start;
mod submodel;
mod summary;
pub mod tape;
mod trace;
pub mod transform;
mod value_reader;
mod warnings;
mod words;

pub use accumulator::{Accumulator, Joined};
pub use bound::{Bound, Workspace};
pub use coordinates::Coordinates;
pub use datum::{Datum, Incomplete, Recordable};
pub use density::{DomainError, FatalError, Location, LogDensity, OtherError, Rejection};
pub use differentiable::{Differentiable, DynDifferentiable};
pub use distribution::*;
pub use dot::dot;
pub use dual::Dual;
pub use expression::Expression;
pub use finite_difference::FiniteDifference;
pub use group::{Group, Values};
pub use inspect::ModelError;
pub use layout::{LabelError, Layout};
pub use ln_sum_exp::ln_sum_exp;
pub use model::{Context, Model};
pub use optimize::{Laplace, Map, Mode, OptimizeError};
pub use parameter::Parameter;
pub use partials::Partials;
pub use posterior::{DivergentPoint, Posterior, PosteriorError, SampleError, SummaryRow};
pub use power_scaling::{PowerScaling, PowerScalingError, Sensitivity, SensitivityRow};
#[doc(inline)]
#[doc = include_str!("../docs/language.md")]
pub use ppl_macros::model;
pub use predictive::{PredictiveCheck, PredictiveError, PredictiveTable};
pub use rand;
pub use rand_xoshiro;
pub use real::Real;
pub use record::{Entry, Record, Role, Variable};
pub use sampler::{
    Chain, ChainStatus, Chains, ChainsFileError, DelayedAcceptance, Divergence, DrawStats,
    InverseMassMatrix, MapKind, MapSwitch, Mcmc, Metropolis, NoUTurn, Nuts, Progress, RandomWalk,
    RunError, Screened, StopReason, WarmupReport,
};
pub use scalar::{Arithmetic, Scalar};
pub use site::{Failure, Site};
pub use start::StartKind;
pub use submodel::{Declaration, Part, Prediction, Submodel};
pub use summary::Summary;
pub use warnings::{Warning, WarningKind};

/// The modelling language: distributions, their variations, and functions for expressions.
pub mod prelude {
    pub use crate::differentiable::{Differentiable, DynDifferentiable};
    pub use crate::distribution::*;
    pub use crate::dot::dot;
    pub use crate::ln_sum_exp::ln_sum_exp;
    pub use crate::optimize::Map;
    pub use crate::parameter::Parameter;
    pub use crate::sampler::{DelayedAcceptance, Metropolis, Nuts};
    pub use crate::scalar::Scalar;
    pub use crate::{LogDensity, Real, model};
}

/// Items that generated code calls, and internal traits behind the public ones. Not public interface: the module is
/// hidden, so that the traits are sealed.
#[doc(hidden)]
pub mod __private {
    pub use crate::accumulator::Settled;
    pub use crate::distribution::{add_terms, constrain};
    pub use crate::literal::literal;
    pub use crate::model::ContextHooks;
    pub use crate::operand::{Apart, Number, Of, Other, Together};
    pub use crate::plate_adjoint::At;
}
