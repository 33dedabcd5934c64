//! The case file: everything that decides a result, in TOML with every unit in its key.
//!
//! `breccia init` writes [`Case::TEMPLATE`], the shipped default case with every key explained.

mod experiments;
mod read;
mod shape;
#[cfg(test)]
mod tests;
mod validate;

use std::collections::BTreeMap;
use std::path::PathBuf;

use ::surrogate::{Design, OrderRule};
use fem::gmsh::PhysicalGroup;
use fem::{Packing, SolverOptions};
use serde::{Deserialize, Serialize};

pub use experiments::{ExperimentsCase, NoiseCase, ScatterCase, TruthCase, VirtualCase};
pub use read::CaseFile;
pub use shape::Shape;

/// What to simulate, what to calibrate, and against which experiments.
///
/// # Example
/// ```
/// use models::CaseFile;
/// let case = CaseFile::default_case().case;
/// assert_eq!(case.material["matrix"].young_mpa, 275.0);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Geometry and mesh.
    pub specimen: SpecimenCase,
    /// Parameters of each region of the mesh.
    pub material: BTreeMap<String, MaterialCase>,
    /// Damage; without it every region is elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_field: Option<PhaseFieldCase>,
    /// The compression test.
    pub test: TestCase,
    /// How the equations are solved.
    #[serde(default)]
    pub solver: SolverCase,
    /// What a single simulation leaves behind.
    #[serde(default)]
    pub output: OutputCase,
    /// How quantities of interest are taken from a curve.
    #[serde(default)]
    pub qoi: QoiCase,
    /// What is calibrated and between which bounds; a single simulation needs none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorCase>,
    /// The runs that the surrogate learns from.
    #[serde(default)]
    pub design: DesignCase,
    /// How the surrogate's order is chosen.
    #[serde(default)]
    pub surrogate: SurrogateCase,
    /// The curves to calibrate against; a single simulation needs none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiments: Option<ExperimentsCase>,
    /// The sampler.
    #[serde(default)]
    pub calibration: CalibrationCase,
    /// The simulations that confirm the calibration.
    #[serde(default)]
    pub confirm: ConfirmCase,
}

/// `[specimen]`: a cylinder on a lattice, or a mesh file instead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpecimenCase {
    /// Radius of the cylinder in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f64>,
    /// Height of the cylinder in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_mm: Option<f64>,
    /// Edge in mm of the hexahedra that are split into tetrahedra.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing_mm: Option<f64>,
    /// Element order, 1 or 2.
    #[serde(default = "one")]
    pub order: u8,
    /// A packing of grains; without it the cylinder is all matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grains: Option<Packing>,
    /// A Gmsh file that replaces the lattice and the packing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// Physical volume, by number or name, of each region in the mesh file.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub regions: BTreeMap<String, PhysicalGroup>,
    /// Physical surfaces of the mesh file: `bottom` and `top`, others as wanted.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, PhysicalGroup>,
}

/// `[material.<region>]`: one region's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialCase {
    /// Elastic law.
    #[serde(default)]
    pub law: LawName,
    /// Young's modulus in MPa.
    pub young_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Critical energy release rate in N/mm; without it the region is elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub toughness_n_per_mm: Option<f64>,
    /// Viscosity of the damage in MPa s.
    #[serde(default)]
    pub viscosity_mpa_s: f64,
    /// Share of the stiffness that full damage leaves.
    #[serde(default = "residual_stiffness")]
    pub residual_stiffness: f64,
}

/// Elastic laws by the name that a case gives them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawName {
    /// Quadratic in the logarithmic strain.
    #[default]
    Hencky,
    /// Compressible neo-Hookean.
    NeoHookean,
}

/// `[phase_field]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseFieldCase {
    /// Crack density function.
    #[serde(default)]
    pub model: CrackName,
    /// Which part of the energy damage degrades.
    #[serde(default)]
    pub split: SplitName,
    /// The split decides what drives damage only; damage degrades the whole energy.
    #[serde(default)]
    pub hybrid: bool,
    /// What keeps a crack from healing.
    #[serde(default)]
    pub irreversibility: IrreversibilityName,
    /// Regularisation length in mm.
    pub length_mm: f64,
    /// Quadrature of the damage terms.
    #[serde(default)]
    pub quadrature: QuadratureName,
}

/// Crack density functions by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CrackName {
    /// α(φ) = φ².
    #[default]
    At2,
    /// α(φ) = φ: elastic up to a threshold.
    At1,
}

/// Irreversibility by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IrreversibilityName {
    /// None: the paper's preset.
    #[default]
    None,
    /// The largest driving energy so far drives damage.
    History,
    /// Damage never falls, node by node.
    ActiveSet,
}

/// Energy splits by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SplitName {
    /// Damage degrades the whole energy: the paper's preset.
    #[default]
    None,
    /// Damage spares volumetric compression.
    VolumetricDeviatoric,
    /// Only what is stretched breaks.
    Spectral,
}

/// Quadratures of the damage terms by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum QuadratureName {
    /// Vertex where the length is small against the elements, else consistent.
    #[default]
    Auto,
    /// At the vertices: damage stays between 0 and 1 on coarse meshes.
    Vertex,
    /// Gauss points.
    Consistent,
}

/// `[test]`: the top platen moves down at constant speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestCase {
    /// Displacement of the platen at the end in mm.
    pub displacement_mm: f64,
    /// Time that it takes in s.
    #[serde(default = "one_second")]
    pub duration_s: f64,
    /// Number of equal load steps; without it they adapt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u32>,
    /// First and largest adaptive step, as shares of the displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveCase>,
    /// Follow a snap-back of rate-independent damage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arc_length: Option<ArcLengthCase>,
    /// How the platens hold the specimen.
    #[serde(default)]
    pub platens: PlatensName,
    /// Coulomb's coefficient of unilateral platens.
    #[serde(default)]
    pub friction: f64,
    /// Velocity in mm/s below which friction fades into creep.
    #[serde(default = "slip_velocity")]
    pub slip_velocity_mm_per_s: f64,
    /// Viscous drag of unilateral platens in MPa s/mm.
    #[serde(default)]
    pub drag_mpa_s_per_mm: f64,
    /// Stop once the force is this share below its peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_below_peak: Option<f64>,
}

/// `test.adaptive`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdaptiveCase {
    /// First step.
    pub first: f64,
    /// Largest step.
    pub largest: f64,
}

/// `test.arc_length`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArcLengthCase {
    /// Largest step of the platen, as a share of the displacement.
    pub step: f64,
    /// Crack energy in N mm that a step may add.
    pub release_n_mm: f64,
}

/// Platens by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PlatensName {
    /// The ends keep to the platens and slide freely.
    #[default]
    Sliding,
    /// The ends may lift off; friction and drag resist sliding.
    Unilateral,
}

/// `[solver]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverCase {
    /// Which fields are solved for together.
    pub scheme: SchemeName,
    /// Largest relative residual of a converged step.
    pub tolerance: f64,
    /// Most Newton iterations of a step.
    pub iterations: u32,
    /// Most alternations of a step.
    pub alternations: u32,
}

/// Nonlinear solvers by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SchemeName {
    /// Displacement and damage together, in turn where that fails.
    #[default]
    Monolithic,
    /// Displacement and damage in turn.
    Alternate,
}

/// `[output]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputCase {
    /// Load steps from one file of fields to the next; zero writes none.
    pub fields_every: u32,
    /// Load steps from one saved state to the next; zero saves none.
    pub checkpoint_every: u32,
}

/// `[qoi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QoiCase {
    /// Where the initial slope is taken, as a fraction of the displacement at peak.
    pub slope_fraction: f64,
}

/// `[prior]`: the box of the uniform priors, also the surrogate's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PriorCase {
    /// The region whose parameters are calibrated.
    #[serde(default = "matrix")]
    pub region: String,
    /// Lower and upper bound of Young's modulus in MPa.
    #[serde(deserialize_with = "read::two_numbers")]
    pub young_mpa: [f64; 2],
    /// Bounds of the critical energy release rate in N/mm.
    #[serde(deserialize_with = "read::two_numbers")]
    pub toughness_n_per_mm: [f64; 2],
    /// Bounds of the viscosity in MPa s.
    #[serde(deserialize_with = "read::two_numbers")]
    pub viscosity_mpa_s: [f64; 2],
}

/// `[design]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DesignCase {
    /// Number of simulations.
    pub runs: usize,
    /// Seed of the design.
    pub seed: u64,
    /// How the prior box is filled.
    pub method: Design,
}

/// `[surrogate]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurrogateCase {
    /// Highest total order tried.
    pub max_order: usize,
    /// Rule that chooses the order.
    pub rule: OrderRule,
}

/// `[calibration]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CalibrationCase {
    /// Markov chains.
    pub chains: usize,
    /// Warmup draws a chain.
    pub warmup: usize,
    /// Kept draws a chain.
    pub draws: usize,
    /// Mean acceptance that the step size is tuned to.
    pub target_accept: f64,
    /// Seed of the chains.
    pub seed: u64,
}

/// `[confirm]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConfirmCase {
    /// Simulations at posterior draws, beside the one at the MAP.
    pub draws: usize,
}

impl Case {
    /// The shipped default case, every key explained.
    pub const TEMPLATE: &str = include_str!("../../cases/default.toml");
}

impl PriorCase {
    /// Names with units, in the order of [`PriorCase::bounds`]: keys of the case, columns of every table.
    pub const NAMES: [&str; 3] = ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"];

    /// Lower and upper bounds of the three parameters.
    pub fn bounds(&self) -> [[f64; 2]; 3] {
        [self.young_mpa, self.toughness_n_per_mm, self.viscosity_mpa_s]
    }
}

impl Default for SolverCase {
    fn default() -> Self {
        let SolverOptions { tolerance, iterations, alternations, .. } = SolverOptions::default();
        Self { scheme: SchemeName::Monolithic, tolerance, iterations, alternations }
    }
}

impl Default for OutputCase {
    fn default() -> Self {
        Self { fields_every: 1, checkpoint_every: 10 }
    }
}

impl Default for QoiCase {
    fn default() -> Self {
        Self { slope_fraction: 0.3 }
    }
}

impl Default for DesignCase {
    fn default() -> Self {
        Self { runs: 100, seed: 1, method: Design::LatinHypercube }
    }
}

impl Default for SurrogateCase {
    fn default() -> Self {
        Self { max_order: 8, rule: OrderRule::CorrectedLoo }
    }
}

impl Default for CalibrationCase {
    fn default() -> Self {
        Self { chains: 4, warmup: 1000, draws: 2000, target_accept: 0.95, seed: 7 }
    }
}

impl Default for ConfirmCase {
    fn default() -> Self {
        Self { draws: 4 }
    }
}

fn one() -> u8 {
    1
}

fn one_second() -> f64 {
    1.0
}

fn slip_velocity() -> f64 {
    1e-3
}

fn residual_stiffness() -> f64 {
    0.01
}

fn matrix() -> String {
    "matrix".into()
}
