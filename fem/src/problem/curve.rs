//! What a test yields.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::boundary::ContactPoint;
use crate::error::FemError;
use crate::fields::Fields;
use crate::solve::Effort;

/// One converged load step; compression is positive.
///
/// It is read by the names of its fields or of the columns of a curve file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Time, s.
    pub time_s: f64,
    /// Displacement of the surface that is measured, mm: how far the upper platen has come down.
    pub displacement_mm: f64,
    /// Force on the body through that surface, N: of prescribed values, of a platen and of tractions.
    #[serde(alias = "force_N")]
    pub force_n: f64,
    /// Elastic energy ∫ g ψ⁺ + ψ⁻ dV, N mm.
    #[serde(alias = "elastic_N_mm")]
    pub elastic_n_mm: f64,
    /// Crack energy ∫ Gc/(c₀ ℓ₀) (α + ℓ₀² |∇φ|²) dV, N mm.
    #[serde(alias = "fracture_N_mm")]
    pub fracture_n_mm: f64,
    /// Energy dissipated by the viscosity so far, ∫∫ ξ φ̇² dV dt, N mm.
    #[serde(alias = "viscous_N_mm")]
    pub viscous_n_mm: f64,
    /// Energy dissipated by friction and drag at the platens so far, N mm.
    #[serde(default, alias = "friction_N_mm")]
    pub friction_n_mm: f64,
    /// Work of loads, supports and prescribed damage so far, ∫ F du by the trapezoid rule, N mm.
    #[serde(default, alias = "work_N_mm")]
    pub work_n_mm: f64,
    /// Mean damage over the volume of the regions that have a toughness.
    pub phi_mean: f64,
    /// Largest nodal damage.
    pub phi_max: f64,
    /// Newton iterations of the step, those of tries without equilibrium included.
    #[serde(default)]
    pub newton: u32,
    /// Linear solves of the step, or the iterations of an iterative linear solver.
    #[serde(default)]
    pub linear: u32,
    /// Residual at the end of the step, of forces relative to the largest reactions so far or of damage relative to
    /// its largest driving force so far, whichever is larger.
    #[serde(default)]
    pub residual: f64,
}

impl CurvePoint {
    /// Work less stored and dissipated energy, N mm.
    ///
    /// Zero for the exact solution; O(Δt) and of one sign with the backward Euler rule.
    pub fn balance_n_mm(&self) -> f64 {
        let dissipated = self.fracture_n_mm + self.viscous_n_mm + self.friction_n_mm;
        self.work_n_mm - self.elastic_n_mm - dissipated
    }
}

/// The derivatives of the force by parameters of the materials along a curve, at the times and
/// displacements of its points; [`Problem::with_sensitivities`](crate::Problem::with_sensitivities)
/// asks for them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensitivities {
    /// The names of the parameters.
    pub names: Vec<String>,
    /// ∂F/∂θ in N for each unit of the parameter: a row for each point of the curve, a column for
    /// each parameter. Fewer rows than points where the derivatives ceased to exist, and with them
    /// those from there on.
    pub force_n: Vec<Vec<f64>>,
    /// Why there are none behind the last row: as a rule, that the tangent is singular at the next point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<String>,
}

impl Sensitivities {
    /// Whether there are no parameters.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}

/// Why a test ended.
#[derive(Clone, Debug, Default)]
pub enum End {
    /// The full displacement, or the end of the schedule, was reached.
    #[default]
    Displacement,
    /// The force fell as far below its peak as asked.
    BelowPeak,
    /// The observer asked to stop before the end.
    Interrupted,
    /// No equilibrium was found; the curve holds what came before.
    Failed(FemError),
}

/// The result of a test.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One point a load step; the unloaded start is not among them.
    pub curve: Vec<CurvePoint>,
    /// The derivatives of the force along the curve, if any were asked for.
    pub sensitivities: Sensitivities,
    /// Why it ended.
    pub end: End,
    /// The fields at the last point.
    pub fields: Fields,
    /// The force on the body through each surface with a condition, N, one a load step: of the components that are
    /// prescribed there, of a platen and of tractions. With the body force they are in equilibrium. Where surfaces that
    /// prescribe the same component meet, its force is shared by the area of their triangles at the node.
    pub reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// For each surface that faces a platen it may leave: its nodes at the last point.
    pub contact: BTreeMap<String, Vec<ContactPoint>>,
    /// Work done by the solver.
    pub effort: Effort,
    /// Where linear systems were solved, in words: a device by its name, or the processor.
    pub machine: String,
}
