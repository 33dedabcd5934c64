//! What one simulation takes beside its materials: damage, test, solver, output.

use fem::SolverOptions;
use serde::{Deserialize, Serialize};

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
    /// Damage spares the energy of a change of volume under pressure; for every elastic law.
    VolumetricDeviatoric,
    /// Only what is stretched breaks; for `hencky`.
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
    /// Gauss points, of quadratic elements fourteen.
    Consistent,
    /// Gauss points, of quadratic elements eleven, one with a negative weight.
    Eleven,
}

/// `[test]`: the top platen moves down at constant speed, unless [`ConditionsCase`](crate::ConditionsCase)
/// says what acts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestCase {
    /// Displacement of the platen at the end in mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_mm: Option<f64>,
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
    /// What solves the linear systems.
    pub linear: LinearName,
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

/// Linear solvers by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinearName {
    /// A sparse factor up to some 70 000 unknowns (30 000 without damage), multigrid above.
    #[default]
    Auto,
    /// A sparse factor.
    Direct,
    /// Krylov iterations with algebraic multigrid.
    Multigrid,
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

impl Default for SolverCase {
    fn default() -> Self {
        let SolverOptions { tolerance, iterations, alternations, .. } = SolverOptions::default();
        let (scheme, linear) = (SchemeName::Monolithic, LinearName::Auto);
        Self { scheme, linear, tolerance, iterations, alternations }
    }
}

impl Default for OutputCase {
    fn default() -> Self {
        Self { fields_every: 1, checkpoint_every: 10 }
    }
}

fn one_second() -> f64 {
    1.0
}

fn slip_velocity() -> f64 {
    1e-3
}
