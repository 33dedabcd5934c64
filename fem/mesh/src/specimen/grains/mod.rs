//! Grains: the interface through which a mesher queries grains, analytic grains, and grains of labelled voxels.

mod cells;
mod field;
mod grain;
mod grain_list;
mod phases;
mod polyhedron;
mod signed_distance;
mod voxel_grains;

pub(crate) use cells::Cells;
pub use field::GrainField;
pub use grain::{Grain, GrainShape};
pub use grain_list::GrainList;
pub(crate) use phases::Phases;
pub use polyhedron::ConvexPolyhedron;
pub use voxel_grains::VoxelGrains;
