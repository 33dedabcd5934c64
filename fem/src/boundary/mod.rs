//! Boundary conditions: prescribed values, symmetry, loads, rigid platens.

mod compiled;
mod conditions;
mod constraint;
mod contact;
mod driven;
mod external;
mod function;
mod gauge;
mod loads;
mod measured;
mod node_set;
mod pressure;
mod reaction;
mod rigid;

pub use conditions::{Axis, Conditions};
pub use contact::{ContactPoint, Platen};
pub use node_set::NodeSet;

pub(crate) use compiled::Boundary;
pub(crate) use contact::Contact;
pub(crate) use driven::DrivenPlaten;
pub(crate) use external::ExternalForces;
