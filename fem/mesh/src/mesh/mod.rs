//! Tetrahedral meshes: where they come from, whether they are sound, and where they go.

pub(crate) mod curved;
mod edges;
pub mod gmsh;
mod lattice;
mod quality;
mod region_volumes;
pub mod stl;
pub(crate) mod tet_mesh;
mod validate;
pub(crate) mod vector;
pub mod vtu;

pub use lattice::{CylinderLattice, LatticeError};
pub use quality::Quality;
pub use tet_mesh::{Mixture, TetMesh};
