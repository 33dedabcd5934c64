//! Grains as closed triangle surfaces: distances, separation, overlaps, and import from STL files.

mod enclosing;
mod files;
mod gap;
mod import;
mod overlap;
mod separate;
mod surface_grains;
mod triangle_tree;

pub use enclosing::enclosing_cylinder;
pub use files::SurfaceImportError;
pub use import::{ImportedSurfaces, SurfaceAxis, SurfaceImport};
pub use separate::{SeparateError, Separated, least_gap_mm, separated};
pub use surface_grains::{SurfaceError, SurfaceGrains};
