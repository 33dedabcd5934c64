//! Synthetic microstructures whose truth is known: seeded packings of grains in a cylinder.

mod grain;
mod packing;
mod polyhedron;
mod relax;
mod shape;

pub use grain::{Grain, GrainShape};
pub use packing::{GrainForm, Packing, PackingError, SizeClass};
pub use polyhedron::ConvexPolyhedron;
