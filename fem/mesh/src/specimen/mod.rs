//! Specimens: the geometry and the sources of grains in a cylinder, and meshes of these grains.
//!
//! - `grains`: the interface through which a mesher queries grains; analytic grains and labelled voxels
//! - `packing`: random packings
//! - `scanner`: synthetic images with known ground truth
//! - `surfaces`: grains as closed surfaces, and the import of such grains from STL files
//! - `meshing`: meshes of specimens with grains, by labels, volume fractions or conforming interfaces

mod grains;
mod meshing;
mod packing;
mod scanner;
mod surfaces;

pub use grains::{ConvexPolyhedron, Grain, GrainField, GrainList, GrainShape, VoxelGrains};
pub use meshing::{
    FractionTarget, GrainMode, GrainVolume, LabelReport, Labelling, MeshReport, Meshed,
    MeshedGrain, MeshedPhase, Meshing, MeshingError, label,
};
pub use packing::{GrainForm, Packing, PackingError, SizeClass};
pub use scanner::{Scan, ScanError, Scanner};
pub use surfaces::{
    ImportedSurfaces, SeparateError, Separated, SurfaceAxis, SurfaceError, SurfaceGrains,
    SurfaceImport, SurfaceImportError, enclosing_cylinder, least_gap_mm, separated,
};
