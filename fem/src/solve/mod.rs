//! Nonlinear and linear solvers.
//!
//! The modules, in the order of their layers:
//!
//! 1. `options`, `effort`: settings and counters
//! 2. `linear`: linear systems
//! 3. `norms`: norms of residuals
//! 4. `force_control`: equations of a platen with a prescribed force
//! 5. `newton`: Newton's method with line search and bounds
//! 6. `alternate`, `flow`, `arc_length`, `predict`, `contact_passes`: methods that call Newton's method
//! 7. `directions`, `sensitivity`: derivatives of an equilibrium with respect to parameters
//! 8. `scheme`: solution of an increment by the selected scheme

mod alternate;
mod arc_length;
mod contact_passes;
mod directions;
mod effort;
mod flow;
mod force_control;
mod linear;
mod newton;
mod norms;
mod options;
mod predict;
mod scheme;
mod sensitivity;

pub use effort::Effort;
pub use options::{LinearScheme, Scheme, SolverOptions};

pub(crate) use arc_length::ArcLengthControl;
pub(crate) use force_control::ForceControl;
pub(crate) use linear::LinearPlan;
#[cfg(feature = "bench-internals")]
pub(crate) use linear::{LinearSolver, Nodal};
pub(crate) use norms::{Rounding, Scales};
pub(crate) use scheme::Solver;
pub(crate) use sensitivity::{Equilibrium, Known, Measured, Rates, differentiate};
