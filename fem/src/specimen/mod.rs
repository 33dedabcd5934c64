//! Synthetic microstructures whose truth is known: seeded packings of grains in a cylinder.

mod adjacency;
mod grain;
mod label;
mod packing;
mod polyhedron;
mod relax;
mod shape;

pub use grain::{Grain, GrainShape};
pub use label::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use packing::{GrainForm, Packing, PackingError, SizeClass};
pub use polyhedron::ConvexPolyhedron;
