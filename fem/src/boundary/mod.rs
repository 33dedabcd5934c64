//! General boundary conditions: prescribed values, symmetry, loads, rigid platens.

mod applied;
mod compiled;
mod conditions;
mod contact;
mod rigid;

pub use conditions::{Axis, Conditions};
pub use contact::{ContactPoint, Platen};

pub(crate) use applied::Applied;
pub(crate) use compiled::Boundary;
pub(crate) use conditions::Function;
pub(crate) use contact::{Contact, ContactStep};
