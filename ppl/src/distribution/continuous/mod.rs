//! Continuous univariate distributions.

mod beta;
mod cauchy;
mod exponential;
mod gamma;
mod gumbel;
mod half_cauchy;
mod half_normal;
mod inverse_gamma;
mod log_normal;
mod normal;
mod student_t;
mod triangular;
mod uniform;
mod weibull;

pub use beta::Beta;
pub use cauchy::Cauchy;
pub use exponential::Exponential;
pub use gamma::Gamma;
pub use gumbel::Gumbel;
pub use half_cauchy::HalfCauchy;
pub use half_normal::HalfNormal;
pub use inverse_gamma::InverseGamma;
pub use log_normal::LogNormal;
pub use normal::Normal;
pub use student_t::StudentT;
pub use triangular::Triangular;
pub use uniform::Uniform;
pub use weibull::Weibull;
