//! Builders of meshes of simple bodies: hexahedra divided into tetrahedra.

mod block;
mod cylinder;
mod hexahedra;
mod round_bar;

pub use block::{Block, BlockError, HexSplit};
pub(crate) use cylinder::WallSection;
pub use cylinder::{CylinderLattice, LatticeError, Wall};
pub use round_bar::RoundBar;
