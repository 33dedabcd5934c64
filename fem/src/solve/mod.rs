//! Newton, alternate minimisation, and the sparse direct solver.

mod alternate;
mod direct;
mod newton;
mod options;
mod ordering;

pub use newton::Effort;
pub use options::{Scheme, SolverOptions};

pub(crate) use direct::{Direct, Symbolic};
pub(crate) use newton::{Solver, StepFailure};
pub(crate) use ordering::fill_reducing;
