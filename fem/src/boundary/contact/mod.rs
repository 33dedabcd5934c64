//! Rigid platens: unilateral contact, Coulomb friction, viscous drag.

mod nodal;
mod platen;

pub use nodal::ContactPoint;
pub use platen::Platen;

pub(crate) use nodal::{Contact, ContactStep};
