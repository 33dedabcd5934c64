//! Generalised linear models: one statement for all data about a linear predictor.
//!
//! ηᵢ = aᵢ + Σₖ xᵢₖ bₖ for known predictors x, an intercept a and slopes b. A family adds what it makes
//! of η; that x is known lets it prepare the data when they are bound.

mod design;
mod intercept;
mod link;
mod normal;
mod regression;
mod statistics;

pub use design::{Design, Predictors};
pub use intercept::{ByGroup, Intercept};
pub use link::{BernoulliLogitGlm, PoissonLogGlm};
pub use normal::NormalGlm;
