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
mod compression;
mod contact;
mod element;
mod error;
mod material;
mod mesh;
mod operator;
mod solve;

pub use compression::{
    CompressionTest, CurvePoint, End, Fields, Loading, Observer, Outcome, PartTimes, Stepping, read_curve,
    write_curve,
};
pub use element::Order;
pub use error::FemError;
pub use material::{CrackDensity, DamageQuadrature, ElasticLaw, Material, PhaseField, Split};
pub use solve::{Effort, Scheme, SolverOptions};

pub use mesh::Quality;
pub use mesh::gmsh;
pub use mesh::{CylinderLattice, LatticeError};
pub use mesh::{MeshError, TetMesh};
