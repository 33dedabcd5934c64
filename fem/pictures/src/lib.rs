//! Shaded pictures of grains, meshes and damage, drawn pixel by pixel.
//!
//! This crate depends on images and meshes only. This crate is separate from `models`, whose report shows the pictures,
//! because the pictures need a crate that is compiled with all optimisations.
//!
//! ```
//! let lattice = fem_mesh::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
//! let picture = fem_pictures::mesh_picture(&lattice.build()?);
//! assert!(picture.width() > 0 && picture.height() > 0);
//! # Ok::<(), fem_mesh::LatticeError>(())
//! ```
//!
//! # Modules
//!
//! In order of their layers. A module imports only from modules earlier in this list.
//!
//! 1. `raster`, `canvas`: pixels, and drawing of triangles with a depth buffer
//! 2. `camera`: projection of points to the picture, and brightness of faces
//! 3. `grain_picture`, `mesh_picture`, `damage_picture`: the pictures

mod camera;
mod canvas;
mod damage_picture;
mod grain_picture;
mod mesh_picture;
mod raster;

pub use damage_picture::{DamagedBody, LEGEND, damage_picture};
pub use grain_picture::grain_picture;
pub use mesh_picture::mesh_picture;
pub use raster::{Raster, side_by_side};
