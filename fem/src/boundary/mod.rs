//! General boundary conditions: prescribed values, symmetry, loads, rigid platens.

mod applied;
mod compiled;
mod conditions;
mod domain;
mod problem;
mod rigid;
mod triangle;

pub use conditions::{Axis, Conditions};
pub use domain::PointValues;
pub use problem::Problem;

pub(crate) use applied::Applied;
pub(crate) use compiled::Boundary;
pub(crate) use conditions::Function;
pub(crate) use domain::Domain;
