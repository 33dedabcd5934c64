//! Families of vectors and matrices.

mod cholesky_factor;
mod dirichlet;
mod dyn_cholesky_factor;
mod dyn_lkj_cholesky;
mod dyn_scale;
mod gaussian_process;
mod lkj;
mod lkj_cholesky;
mod mv_normal_cholesky;
mod scale;

pub use cholesky_factor::CholeskyFactor;
pub use dirichlet::Dirichlet;
pub use dyn_cholesky_factor::DynCholeskyFactor;
pub use dyn_lkj_cholesky::DynLkjCholesky;
pub use gaussian_process::{
    GaussianProcess, Kernel, Lengths, Matern32, Matern52, Mean, Point, Prediction,
    SquaredExponential,
};
pub use lkj_cholesky::LkjCholesky;
pub use mv_normal_cholesky::{MvNormalCholesky, Scale};
