//! Probabilistic programming in Rust: write a model, condition it on data, sample its unknowns.
//!
//! A model is a function of its data, declared with [`model!`]. The language has one main rule: **`let x ~ D` declares
//! an unknown; `y ~ D` without `let` conditions on the existing value `y`.** The page of [`model!`] is the reference.
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
//! assert!((posterior.mean("stiffness")? - 2.0).abs() < 0.1);
//! let [low, high] = posterior.interval("stiffness", 0.9)?;
//! assert!(low < 2.0 && 2.0 < high);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [`guide`] begins with [a crate of your own](guide::first_crate) and teaches the language in short pages.
//!
//! # Contents
//! - **Models**: declare them with [`model!`], or implement the trait [`Model`]; [`Bound`] is a model with its data.
//! - **Distributions**: one type per distribution, with the variations of [`Family`]: `.iid(n)`, `.array::<N>()`,
//!   `.truncate(a..b)`, `.ordered()`. User-defined distributions implement [`Density`].
//! - **Derivatives**: exact, by reverse mode. User-defined functions implement [`Differentiable`]. [`FiniteDifference`]
//!   differentiates functions without derivatives, and [`OdeSolution`] solves differential equations.
//! - **Samplers**: [`Nuts`] uses gradients. [`Metropolis`] and [`DelayedAcceptance`] need no gradients;
//!   [`DelayedAcceptance`] first tests proposals with a cheap density. All samplers accept models and other log densities.
//!   A user-defined sampler implements [`Kernel`]. Chains run in parallel, with the same draws for any number of
//!   threads. [`Map`] finds joint modes, [`Laplace`] the normal approximation at a mode.
//! - **Results**: [`Posterior`] contains named draws with shapes. A posterior provides a summary, diagnostics with
//!   explanations, predictive checks, cross-validation, prior sensitivity, and export for ArviZ.
//! - **[`check`]**: statistical assertions for `cargo test`.
//!
//! # The order of the modules
//! A module imports only modules that precede it in this list.
//! 1. `density`: log densities, rejected points, the statements that reject them
//! 2. `quantity`: named quantities: data, records, layouts, draws
//! 3. `special`: special functions
//! 4. `number`: scalar types, with derivatives by dual numbers and by a tape
//! 5. `term`: terms of a log density: parameters, formulas, accumulators
//! 6. `forward`: user-defined functions with derivatives
//! 7. `transform`: maps from unconstrained to constrained values
//! 8. `distribution`: distributions, one family per file
//! 9. `model`: the traits behind `model!`, the contexts that evaluate a model, models with their data
//! 10. `optimize`, `sampler`: MAP and Laplace; NUTS and Metropolis
//! 11. `diagnostics`: convergence diagnostics
//! 12. `posterior`: named draws
//! 13. `judgement`: summary, warnings, predictive checks, prior sensitivity
//! 14. `export`, `check`: files; assertions
//! 15. `guide`: the pages of the guide

extern crate self as ppl;

pub mod check;
mod density;
pub mod diagnostics;
mod distribution;
mod export;
mod forward;
pub mod guide;
mod judgement;
mod model;
mod number;
mod optimize;
mod posterior;
mod quantity;
mod sampler;
pub mod special;
mod term;
pub mod transform;

pub use density::site::{Failure, Site};
pub use density::{DomainError, FatalError, Location, LogDensity, OtherError, Rejection};
pub use distribution::user_defined::{Density, ValueOf};
pub use distribution::*;
pub use forward::differentiable::{Differentiable, DynDifferentiable};
pub use forward::finite_difference::FiniteDifference;
pub use forward::ode::{Ode, OdeSolution};
pub use judgement::power_scaling::{PowerScaling, PowerScalingError, Sensitivity, SensitivityRow};
pub use judgement::predictive::{PredictiveCheck, PredictiveError, PredictiveTable};
pub use judgement::summary::{PredictionRow, Summary, SummaryTables};
pub use judgement::warnings::{Warning, WarningKind};
pub use model::bound::{Bound, Workspace};
pub use model::context::{Context, Model};
pub use model::inspect::ModelError;
pub use model::start::StartKind;
pub use model::submodel::{Declaration, Part, Prediction, Submodel};
pub use number::dual::Dual;
pub use number::ln_sum_exp::ln_sum_exp;
pub use number::partials::Partials;
pub use number::real::Real;
pub use number::scalar::{Arithmetic, Scalar};
pub use number::tape;
pub use optimize::{Laplace, Map, Mode, OptimizeError};
pub use posterior::{
    DivergentPoint, EstimateError, Posterior, PosteriorError, SampleError, SummaryRow,
};
#[doc(inline)]
#[doc = include_str!("../docs/language.md")]
pub use ppl_macros::model;
pub use quantity::coordinates::Coordinates;
pub use quantity::datum::{Datum, Incomplete, Recordable};
pub use quantity::draws::{Group, Values};
pub use quantity::layout::{LabelError, Layout};
pub use quantity::record::{Entry, Record, Role, Variable};
pub use rand;
pub use rand_xoshiro;
pub use sampler::{
    Chain, ChainState, ChainStatus, Chains, ChainsFileError, DelayedAcceptance, Divergence,
    DrawStats, InverseMassMatrix, Kernel, MapKind, MapSwitch, Mcmc, Metropolis, NoUTurn, Nuts,
    Progress, RandomWalk, RunError, Screened, Step, StopReason, UserKernel, WarmupReport,
};
pub use term::accumulator::{Accumulator, Joined};
pub use term::dot::dot;
pub use term::formula::Expression;
pub use term::parameter::Parameter;

/// The modelling language: distributions, their variations, and functions for expressions.
pub mod prelude {
    pub use crate::distribution::*;
    pub use crate::forward::differentiable::{Differentiable, DynDifferentiable};
    pub use crate::number::ln_sum_exp::ln_sum_exp;
    pub use crate::number::scalar::Scalar;
    pub use crate::optimize::Map;
    pub use crate::sampler::{DelayedAcceptance, Metropolis, Nuts};
    pub use crate::term::dot::dot;
    pub use crate::term::parameter::Parameter;
    pub use crate::{LogDensity, Real, model};
}

/// Items that generated code calls, and the internal traits on which the public traits depend. The module is not
/// part of the public interface: the module is hidden, so that the traits are sealed.
#[doc(hidden)]
pub mod __private {
    pub use crate::distribution::user_defined::{add_density, constrain_density};
    pub use crate::distribution::{add_terms, constrain};
    pub use crate::model::context::ContextHooks;
    pub use crate::term::accumulator::Settled;
    pub use crate::term::literal::literal;
    pub use crate::term::operand::{Apart, Number, Of, Other, Together};
    pub use crate::term::plate::At;
}
