//! Grains in a cylinder: packings whose truth is known, and meshes of them.

mod adjacency;
mod conforming;
mod field;
mod fraction;
mod grain;
mod grain_list;
mod grain_mode;
mod label;
mod mesh_report;
mod meshing;
mod packing;
mod phases;
mod polyhedron;
mod relax;
mod samples;
mod scanner;
mod shape;
mod signed_distance;
mod surface_grains;
mod tomography;
mod triangle_tree;
mod voids;
mod voxel_grains;
mod voxelize;

pub use field::GrainField;
pub use grain::{Grain, GrainShape};
pub use grain_list::GrainList;
pub use grain_mode::GrainMode;
pub use label::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use mesh_report::{MeshReport, MeshedGrain, MeshedPhase};
pub use meshing::{Meshed, Meshing, MeshingError};
pub use packing::{GrainForm, Packing, PackingError, SizeClass};
pub use polyhedron::ConvexPolyhedron;
pub use scanner::{Scan, ScanError, Scanner};
pub use surface_grains::{SurfaceError, SurfaceGrains};
pub use voxel_grains::VoxelGrains;
