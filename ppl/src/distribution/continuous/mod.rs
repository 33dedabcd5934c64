//! Continuous univariate distributions.

mod beta;
mod exponential;
mod gamma;
mod half_cauchy;
mod half_normal;
mod log_normal;
mod normal;
mod student_t;
mod uniform;
mod weibull;

pub use beta::Beta;
pub use exponential::Exponential;
pub use gamma::Gamma;
pub use half_cauchy::HalfCauchy;
pub use half_normal::HalfNormal;
pub use log_normal::LogNormal;
pub use normal::Normal;
pub use student_t::StudentT;
pub use uniform::Uniform;
pub use weibull::Weibull;
