//! Tetrahedral meshes: generation, checks, quality, and input and output files.

mod build;
mod cavities;
pub(crate) mod curved;
pub mod gmsh;
pub(crate) mod groups;
mod interface;
mod quality;
pub mod stl;
pub(crate) mod surface;
mod tet_mesh;
pub(crate) mod topology;
pub(crate) mod triangle;
mod validate;
pub(crate) mod vector;
pub mod vtu;

pub(crate) use build::WallSection;
pub use build::{Block, BlockError, CylinderLattice, HexSplit, LatticeError, RoundBar, Wall};
pub use cavities::Cavity;
pub use groups::Groups;
pub use interface::InterfaceSurface;
pub use quality::Quality;
pub use surface::{Surface, decimated};
pub use tet_mesh::{Mixture, TetMesh};
