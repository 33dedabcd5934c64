//! Compression of grain composites: meshes, specimens, materials, solvers and ensembles of runs.
//!
//! `fem` meshes a cylindrical specimen (stiff grains in a soft matrix) with tetrahedra, compresses the specimen until the
//! matrix breaks, and returns the force–displacement curve. The crate contains no statistics: the crates `surrogate` and
//! `models` use its curves for a calibration.
//!
//! ```
//! use fem::{CompressionTest, CylinderLattice, End, Fracture, Material, PhaseField, Schedule};
//!
//! let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
//! let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
//!     toughness_n_per_mm: 0.0025,
//!     viscosity_mpa_s: 0.3,
//!     residual_stiffness: 0.01,
//! });
//! let problem = CompressionTest::new(0.22, Schedule::adaptive(1.0).stop_below_peak(0.1))
//!     .builder(mesh)?
//!     .materials([matrix])
//!     .phase_field(PhaseField::new(0.06))
//!     .build()?;
//!
//! let mut peak: f64 = 0.0;
//! let mut run = problem.start();
//! while let Some(point) = run.step() {
//!     peak = peak.max(point.force_n);
//! }
//! assert!((100.0..125.0).contains(&peak), "{peak} N");
//! assert!(matches!(run.finish().end, End::BelowPeak));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Units: mm, N, MPa, MPa s, N/mm, s. The axis of the cylinder is z, and its bottom is at z = 0. For other loads and
//! supports see [`Problem::builder`]. For the equations, their sources, and the choice of mesh and parameters see
//! [`equations`].
//!
//! # A specimen with grains
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
//! A mesh can also be read from Gmsh ([`gmsh::read`]). [`vtu::write`] writes a mesh for ParaView, and [`stl::write`]
//! writes the surfaces of its grains for other programs.
//!
//! # Modules
//!
//! `fem` re-exports all items of three lower crates, which are compiled in parallel to the solvers: `fem_file`
//! (files), `fem_image` (voxels and grains), `fem_mesh` (meshes and specimens).
//!
//! The modules of this crate, in the order of their layers. A module imports from lower layers only, and no two files
//! import each other.
//!
//! 1. `error`: errors and their causes
//! 2. `fields`: displacement and damage at the nodes
//! 3. `device`: devices that run kernels: a GPU, or the processor as a substitute
//! 4. `parallel`: ranks that share one problem: messages, and the partition of the mesh
//! 5. `element`: linear and quadratic tetrahedra, quadrature, the space on a mesh
//! 6. `material`: laws, damage, and the equations at a quadrature point
//! 7. `operator`: residual and tangent of a whole mesh, bounds of the unknowns
//! 8. `boundary`: conditions, loads, platens and contact
//! 9. `solve`: Newton, alternate minimisation, arc length, contact passes, derivatives with respect to parameters,
//!    linear solvers
//! 10. `problem`: a problem, its load steps, curves and checkpoints
//! 11. `ensemble`: many runs in a directory
//! 12. `bench`: functions for the benchmark of the solver (feature `bench-internals`)

#[cfg(feature = "bench-internals")]
pub mod bench;
mod boundary;
// these hidden modules are not part of the public interface; they are public for the tests in fem/tests/operator
#[doc(hidden)]
#[allow(missing_debug_implementations)]
pub mod device;
#[doc(hidden)]
#[allow(missing_debug_implementations)]
pub mod element;
mod ensemble;
mod error;
mod fields;
#[doc(hidden)]
#[allow(missing_debug_implementations)]
pub mod material;
#[doc(hidden)]
#[allow(missing_debug_implementations)]
pub mod operator;
mod parallel;
mod problem;
mod solve;

#[doc = include_str!("equations.md")]
pub mod equations {}

pub use boundary::{Axis, Conditions, ContactPoint, NodeSet, Platen};
pub use device::{ComputeDevice, DeviceError};
pub use element::{Order, PointValues};
pub use ensemble::{
    Ensemble, EnsembleError, EnsembleProgress, EnsembleState, RunEnd, RunInput, RunRecord,
    RunStatus,
};
pub use error::{CheckpointError, CurveFileError, FemError, StepFailure, Unsupported};
#[doc(inline)]
pub use fem_file::{open_regular, read_regular, read_regular_text, write_atomically};
#[doc(inline)]
pub use fem_image::{
    Contrast, Cylinder, ImageError, LabelPhase, LabelRules, LabelledSpecimen, MATRIX, ReadOptions,
    Reading, Region, RgbSlice, Score, SeedRule, Segmentation, Segmented, SpecimenForm,
    SpecimenRegion, SpecimenStatistics, StackHeader, VOID, Volume, files_of as image_files,
    outlined_slice, read as read_image, read_label_values, read_labels, score, tiff,
};
#[doc(inline)]
pub use fem_mesh::{
    Block, BlockError, Cavity, ConvexPolyhedron, CylinderLattice, FractionTarget, Grain,
    GrainField, GrainForm, GrainList, GrainMode, GrainShape, GrainVolume, HexSplit,
    ImportedSurfaces, InterfaceSurface, LabelReport, Labelling, LatticeError, MeshError,
    MeshReport, Meshed, MeshedGrain, MeshedPhase, Meshing, MeshingError, Mixture, Packing,
    PackingError, Quality, RoundBar, Scan, ScanError, Scanner, SeparateError, Separated, SizeClass,
    Surface, SurfaceAxis, SurfaceError, SurfaceGrains, SurfaceImport, SurfaceImportError, TetMesh,
    VoxelGrains, Wall, decimated, enclosing_cylinder, gmsh, label, least_gap_mm, separated, stl,
    vtu,
};
pub use fields::{Fields, LawState};
pub use material::{
    ConstitutiveLaw, CrackDensity, DamageEnergies, DamageQuadrature, DegradationFunction,
    ElasticLaw, ElasticPoint, ElasticResponse, Elasticity, EnergyKind, EnergySet, EnergySplit,
    Fracture, Hardening, HardeningPoint, Homogenisation, HyperelasticLaw, Inelasticity,
    Irreversibility, Material, MooneyRivlin, Number, Oblique, Ogden, OgdenTerm, PhaseField,
    PlasticRate, Plasticity, Principal, PrincipalStrain, PronyModuli, PronyTerm, Response,
    SaintVenantKirchhoff, Scalar, Split, Strains, Strength, StrengthContext, TimeShift,
    UserConstitutiveLaw, UserDegradation, UserLaw, UserSplit, Viscoelasticity, YieldCriterion,
    assert_material,
};
pub use operator::CellStress;
pub use parallel::{Communicator, RankLost, Ranks};
pub use problem::{
    AdaptiveSteps, ArcLength, Checkpoint, CompressionTest, CrackExtension, CurvePoint, CurveWriter,
    End, Evaluation, FixedSteps, Friction, Interface, LoadProgram, LoadStepper, MaterialParameter,
    Observer, Outcome, PlatenLoad, Platens, Problem, ProblemBuilder, ProblemWarning, ProgramPoint,
    ProgramSteps, Progress, Schedule, SegmentSteps, Sensitivities, Step, StepController,
    TensionTest, read_curve, write_curve,
};
pub use solve::{Effort, LinearScheme, Scheme, SolverOptions};
