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
//!
//! The equations, their sources, and how to choose mesh and parameters: [`equations`].
//!
//! # Crushing it
//!
//! ```
//! use fem::{
//!     CompressionTest, CylinderLattice, Fracture, Loading, Material, Order, PhaseField,
//!     SolverOptions, Stepping,
//! };
//!
//! let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
//! let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
//!     toughness_n_per_mm: 0.0025,
//!     viscosity_mpa_s: 0.3,
//!     residual_stiffness: 0.01,
//! });
//! let damage = PhaseField::new(0.06);
//! let loading = Loading {
//!     displacement_mm: 0.22,
//!     duration_s: 1.0,
//!     stepping: Stepping::adaptive(),
//!     stop_below_peak: Some(0.1),
//! };
//! let options = SolverOptions::default();
//! let test = CompressionTest::new(mesh, Order::Linear, vec![matrix], Some(damage), loading, options)?;
//! let outcome = test.run(&mut ());
//! let peak = outcome.curve.iter().map(|point| point.force_n).fold(0.0, f64::max);
//! assert!((100.0..125.0).contains(&peak), "{peak} N");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod boundary;
mod element;
mod ensemble;
mod error;
mod fields;
mod material;
mod mesh;
mod operator;
mod problem;
mod solve;
mod specimen;

#[doc = include_str!("equations.md")]
pub mod equations {}

pub use boundary::{Axis, Conditions, ContactPoint, Platen};
pub use element::{Order, PointValues};
pub use error::FemError;
pub use fields::Fields;
pub use material::{
    CrackDensity, DamageQuadrature, Elasticity, Fracture, HyperelasticLaw, Irreversibility,
    Material, MooneyRivlin, Ogden, PhaseField, PrincipalStrain, SaintVenantKirchhoff, Split,
    UserLaw, assert_material,
};
pub use num_dual::DualNum;
pub use problem::{
    Checkpoint, CompressionTest, CurvePoint, CurveWriter, End, Friction, Loading, Observer,
    Outcome, PartTimes, Platens, Problem, ProductTimes, Schedule, Stepping, read_curve,
    write_curve,
};
pub use solve::{Effort, LinearScheme, Scheme, SolverOptions};

pub use ensemble::{
    Campaign, CampaignError, CampaignProgress, RunEnd, RunInput, RunRecord, RunStatus,
};
pub use mesh::gmsh;
pub use mesh::vtu;
pub use mesh::{CylinderLattice, LatticeError};

pub use mesh::{MeshError, Quality, TetMesh};
pub use specimen::{ConvexPolyhedron, Grain, GrainShape};
pub use specimen::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use specimen::{GrainForm, Packing, PackingError, SizeClass};
