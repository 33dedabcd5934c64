//! Generalised linear models: one statement for all data about a linear predictor.
//!
//! ηᵢ = aᵢ + Σₖ xᵢₖ bₖ for known predictors x, an intercept a and slopes b. A family adds what it makes
//! of η; that x is known lets it prepare the data when they are bound.

mod bernoulli;
mod design;
mod intercept;
mod normal;
mod poisson;
mod regression;
mod summary;

pub use bernoulli::BernoulliLogitGlm;
pub use design::{Design, Predictors};
pub use intercept::{ByGroup, Intercept};
pub use normal::NormalGlm;
pub use poisson::PoissonLogGlm;
