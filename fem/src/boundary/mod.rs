//! Boundary conditions: prescribed values, symmetry, loads, rigid platens.

mod compiled;
mod conditions;
mod constraint;
mod contact;
mod external;
mod function;
mod loads;
mod reaction;
mod rigid;

pub use conditions::{Axis, Conditions};
pub use contact::{ContactPoint, Platen};

pub(crate) use compiled::Boundary;
pub(crate) use contact::Contact;
pub(crate) use external::ExternalForces;
