//! Compression of grain composites: meshes, specimens, materials, solvers and campaigns of runs.
//!
//! `fem` takes a description of a cylindrical specimen (stiff grains in a soft matrix), meshes
//! it with tetrahedra, compresses it, and gives back the force–displacement curve. It knows
//! nothing of probability: the crates `surrogate` and `models` turn its curves into a
//! calibration.
//!
//! Units everywhere: mm, N, MPa, MPa s, N/mm, s. The cylinder's axis is z and its bottom is at
//! z = 0.
//!
//! # A specimen in five lines
//!
//! ```
//! use fem::{CylinderLattice, Packing, label};
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
//! A mesh can also come from Gmsh ([`gmsh::read`]), and goes to ParaView by [`vtu::write`].

mod compression;
mod contact;
mod element;
mod ensemble;
mod error;
mod material;
mod mesh;
mod operator;
mod solve;
mod specimen;

pub use compression::{
    CompressionTest, CurvePoint, End, Fields, Loading, Observer, Outcome, PartTimes, Stepping,
    read_curve, write_curve,
};
pub use element::Order;
pub use error::FemError;
pub use material::{CrackDensity, DamageQuadrature, ElasticLaw, Material, PhaseField, Split};
pub use solve::{Effort, Scheme, SolverOptions};

pub use ensemble::{
    Campaign, CampaignError, CampaignProgress, RunEnd, RunInput, RunRecord, RunStatus,
};
pub use mesh::gmsh;
pub use mesh::vtu;
pub use mesh::{CylinderLattice, LatticeError};
pub use mesh::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use mesh::{MeshError, Quality, TetMesh};
pub use specimen::{ConvexPolyhedron, Grain, GrainShape};
pub use specimen::{GrainForm, Packing, PackingError, SizeClass};
