//! Tetrahedral meshes: generation, checks, quality, and input and output files.

mod cavities;
pub(crate) mod curved;
mod decimate;
mod edges;
pub mod gmsh;
pub(crate) mod groups;
pub(crate) mod isosurface;
mod lattice;
mod quality;
mod region_volumes;
pub mod stl;
mod stl_read;
mod surface;
pub(crate) mod tet_mesh;
mod validate;
pub(crate) mod vector;
pub mod vtu;

pub use cavities::Cavity;
pub use decimate::decimated;
pub use groups::Groups;
pub use lattice::{CylinderLattice, LatticeError};
pub use quality::Quality;
pub use surface::Surface;
pub use tet_mesh::{Mixture, TetMesh};
