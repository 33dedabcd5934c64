//! Generalised linear models: regressions in which one statement observes all data.
//!
//! The linear predictor is ηᵢ = aᵢ + Σₖ xᵢₖ bₖ, with known predictors x, an intercept a and slopes b. The family
//! determines the distribution of a datum given η. Since x is known, data can be summarised when they are bound.

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
