//! Newton, alternate minimisation, arc length, bounds, and linear solvers.

mod alternate;
mod arc_length;
mod augment;
mod external;
mod linear;
mod newton;
mod norms;
mod options;

pub use newton::Effort;
pub use options::{LinearScheme, Scheme, SolverOptions};

pub(crate) use arc_length::Control;
pub(crate) use external::External;
pub(crate) use linear::LinearPlan;
#[cfg(feature = "bench-internals")]
pub(crate) use linear::{LinearSolver, Nodal};
pub(crate) use newton::Solver;
