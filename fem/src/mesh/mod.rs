//! Tetrahedral meshes: where they come from, whether they are sound, and where they go.

mod error;
pub mod gmsh;
mod islands;
mod label;
mod lattice;
mod quality;
mod tet_mesh;
pub(crate) mod vector;
pub mod vtu;

pub use error::MeshError;
pub use label::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use lattice::{CylinderLattice, LatticeError};
pub use quality::Quality;
pub use tet_mesh::TetMesh;
