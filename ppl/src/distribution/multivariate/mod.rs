//! Distributions of vectors and matrices.

mod dirichlet;
mod factor;
mod lkj;
mod lkj_cholesky;
mod mv_normal_cholesky;
mod mv_normal_terms;
mod mv_student_t_cholesky;
mod size;

pub use dirichlet::Dirichlet;
pub use factor::{CholeskyFactor, DynCholeskyFactor, Factor};
pub use lkj_cholesky::{DynLkjCholesky, LkjCholesky};
pub use mv_normal_cholesky::{MvNormalCholesky, Scale};
pub use mv_student_t_cholesky::MvStudentTCholesky;
pub(super) use size::MatrixEntry;
