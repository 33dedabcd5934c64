//! Families of vectors and matrices.

mod cholesky_factor;
mod dirichlet;
mod gaussian_process;
mod lkj_cholesky;
mod mv_normal_cholesky;

pub use cholesky_factor::CholeskyFactor;
pub use dirichlet::Dirichlet;
pub use gaussian_process::{
    GaussianProcess, Kernel, Lengths, Matern32, Matern52, Mean, Point, Prediction,
    SquaredExponential,
};
pub use lkj_cholesky::LkjCholesky;
pub use mv_normal_cholesky::MvNormalCholesky;
