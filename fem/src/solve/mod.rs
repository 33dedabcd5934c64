//! Nonlinear and linear solvers: Newton, alternate minimisation, arc length, bounds, and derivatives with respect to
//! parameters.

mod alternate;
mod arc_length;
mod augment;
mod directions;
mod external;
mod fallback;
mod flow;
mod linear;
mod newton;
mod norms;
mod options;
mod predict;
mod sensitivity;

pub use newton::Effort;
pub use options::{LinearScheme, Scheme, SolverOptions};

pub(crate) use arc_length::Control;
pub(crate) use external::External;
pub(crate) use linear::LinearPlan;
#[cfg(feature = "bench-internals")]
pub(crate) use linear::{LinearSolver, Nodal};
pub(crate) use newton::Solver;
pub(crate) use norms::{Rounding, Scales};
pub(crate) use sensitivity::{Known, Measured, Rates};
