//! Synthetic microstructures whose truth is known: seeded packings of grains in a cylinder.

mod adjacency;
mod field;
mod grain;
mod grain_list;
mod label;
mod packing;
mod polyhedron;
mod relax;
mod samples;
mod shape;

pub use field::GrainField;
pub use grain::{Grain, GrainShape};
pub use grain_list::GrainList;
pub use label::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use packing::{GrainForm, Packing, PackingError, SizeClass};
pub use polyhedron::ConvexPolyhedron;
