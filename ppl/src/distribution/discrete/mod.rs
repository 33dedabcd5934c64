//! Distributions of counts and flags.

mod bernoulli;
mod bernoulli_logit;
mod binomial;
mod count_parameter;
mod negative_binomial;
mod poisson;

pub use bernoulli::Bernoulli;
pub use bernoulli_logit::BernoulliLogit;
pub use binomial::{Binomial, BinomialLogit};
pub use count_parameter::CountParameter;
pub use negative_binomial::NegativeBinomial;
pub use poisson::{Poisson, PoissonLog};
