//! Distributions of vectors and matrices.

mod factor;
mod lkj;
mod lkj_cholesky;
mod mv_normal_cholesky;
mod mv_normal_terms;
mod size;

pub use factor::{CholeskyFactor, DynCholeskyFactor, Factor};
pub use lkj_cholesky::{DynLkjCholesky, LkjCholesky};
pub use mv_normal_cholesky::{MvNormalCholesky, Scale};
pub(super) use size::MatrixEntry;
