//! Tetrahedral meshes of grains in a matrix, with packings and images of grains as input.
//!
//! A mesh is generated from a lattice whose tetrahedra are labelled with grains ([`Meshing`]), built as a [`Block`] or
//! a cylinder ([`CylinderLattice`]), or read from a Gmsh file ([`gmsh::read`]). A mesh can be written for Gmsh, ParaView
//! ([`vtu`]) and as STL ([`stl`]). Grains come from a [`Packing`], a list ([`GrainList`]), a segmented image
//! ([`VoxelGrains`]), or closed surfaces ([`SurfaceGrains`]). Lengths are in mm; the axis of a cylinder is z, and its
//! bottom is at z = 0. The crate `fem` re-exports all items of this crate.
//!
//! ```
//! use fem_mesh::{CylinderLattice, Packing, label};
//!
//! let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
//! let mut mesh = lattice.build()?;
//! let grains = Packing::new(0.2, 1).fill(lattice.radius_mm, lattice.height_mm)?;
//! let report = label(&mut mesh, &grains);
//! assert!((report.achieved_fraction - report.asked_fraction).abs() < 0.005);
//! mesh.validate()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Modules
//!
//! The modules in the order of their layers. A module imports from lower layers only, and no two files import each
//! other.
//!
//! 1. `error`: errors of meshes and mesh files
//! 2. `mesh`: tetrahedra with named regions and surfaces; Gmsh, ParaView and STL files
//! 3. `specimen`: grains, packings, the virtual scanner, and meshes of grains

mod error;
mod mesh;
mod specimen;

pub use error::MeshError;
#[doc(hidden)] // the operator and the solvers of `fem` use the same storage
pub use mesh::Groups;
pub use mesh::{
    Block, BlockError, Cavity, CylinderLattice, HexSplit, InterfaceSurface, LatticeError, Mixture,
    Quality, RoundBar, Surface, TetMesh, Wall, decimated, gmsh, stl, vtu,
};
pub use specimen::{
    ConvexPolyhedron, FractionTarget, Grain, GrainField, GrainForm, GrainList, GrainMode,
    GrainShape, GrainVolume, ImportedSurfaces, LabelReport, Labelling, MeshReport, Meshed,
    MeshedGrain, MeshedPhase, Meshing, MeshingError, Packing, PackingError, Scan, ScanError,
    Scanner, SeparateError, Separated, SizeClass, SurfaceAxis, SurfaceError, SurfaceGrains,
    SurfaceImport, SurfaceImportError, VoxelGrains, enclosing_cylinder, label, least_gap_mm,
    separated,
};
