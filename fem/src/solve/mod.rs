//! Newton, alternate minimisation, and the sparse direct solver.

mod alternate;
mod linear;
mod newton;
mod options;

pub use newton::Effort;
pub use options::{Scheme, SolverOptions};

pub(crate) use linear::LinearPlan;
pub(crate) use newton::{Solver, StepFailure};
