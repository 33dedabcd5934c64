//! Cholesky factors of correlation and covariance matrices.

mod algebra;
mod angles;
mod factor;

pub(super) use angles::Angles;
pub use factor::CholeskyFactor;
pub(super) use factor::Whole;
