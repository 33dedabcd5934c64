//! Families of counts, flags and categories.

mod bernoulli;
mod bernoulli_logit;
mod binomial;
mod categorical;
mod count_parameter;
mod negative_binomial;
mod poisson;
mod poisson_log;

pub use bernoulli::Bernoulli;
pub use bernoulli_logit::BernoulliLogit;
pub use binomial::{Binomial, BinomialLogit};
pub use categorical::{Categorical, CategoricalLogit};
pub use count_parameter::CountParameter;
pub use negative_binomial::NegativeBinomial;
pub use poisson::Poisson;
pub use poisson_log::PoissonLog;
