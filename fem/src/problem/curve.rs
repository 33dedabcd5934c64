//! Results of a test.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::boundary::ContactPoint;
use crate::error::FemError;
use crate::fields::Fields;
use crate::solve::Effort;

/// One converged load step. Compression is positive.
///
/// Deserialised by the names of its fields or by the columns of a curve file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Time, s.
    pub time_s: f64,
    /// Displacement of the measured surface, mm; in a compression test the downward displacement of the upper platen.
    pub displacement_mm: f64,
    /// Force on the body through the measured surface, N: from prescribed values, a platen and tractions.
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
    /// Newton iterations of the step, including failed attempts.
    #[serde(default)]
    pub newton: u32,
    /// Linear solves of the step, or the iterations of an iterative linear solver.
    #[serde(default)]
    pub linear: u32,
    /// Residual at the end of the step: the larger of the force residual relative to the largest reactions so far,
    /// and the damage residual relative to the largest driving force so far.
    #[serde(default)]
    pub residual: f64,
}

impl CurvePoint {
    /// Returns work minus stored and dissipated energy, N mm.
    ///
    /// Zero for the exact solution; O(Δt) and of constant sign with the backward Euler rule.
    pub fn balance_n_mm(&self) -> f64 {
        let dissipated = self.fracture_n_mm + self.viscous_n_mm + self.friction_n_mm;
        self.work_n_mm - self.elastic_n_mm - dissipated
    }
}

/// Derivatives of the force with respect to material parameters, at the times and displacements of the points of a
/// curve. Enabled by [`Problem::with_sensitivities`](crate::Problem::with_sensitivities).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensitivities {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// ∂F/∂θ, in N per unit of the parameter: one row per point of the curve, one column per parameter. There are
    /// fewer rows than points if a derivative could not be computed; the rows of this and all later points are then
    /// missing.
    pub force_n: Vec<Vec<f64>>,
    /// Reason for missing rows, usually a singular tangent at the next point.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<String>,
}

impl Sensitivities {
    /// Whether there are no parameters.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}

/// Reason for the end of a test.
#[derive(Clone, Debug, Default)]
pub enum End {
    /// The full displacement, or the end of the schedule, was reached.
    #[default]
    Displacement,
    /// The force fell below its peak by the requested fraction.
    BelowPeak,
    /// The run was stopped before its end, e.g. by the observer.
    Interrupted,
    /// No equilibrium was found; the curve contains the points before the failure.
    Failed(FemError),
}

/// The result of a test.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// One point per load step, without the unloaded start.
    pub curve: Vec<CurvePoint>,
    /// Derivatives of the force along the curve, if requested.
    pub sensitivities: Sensitivities,
    /// Reason for the end of the test.
    pub end: End,
    /// Fields at the last point.
    pub fields: Fields,
    /// Force on the body through each surface with a condition, N, one entry per load step: from the components that
    /// are prescribed there, from a platen and from tractions. The sum of these forces and the body force is zero. If
    /// several surfaces prescribe the same component at a common node, its force is distributed in proportion to the
    /// area of their triangles at the node.
    pub reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// Contact points at the last point of the curve, for each surface with a unilateral platen.
    pub contact: BTreeMap<String, Vec<ContactPoint>>,
    /// Work done by the solver.
    pub effort: Effort,
    /// Hardware that solved the linear systems, as text: name of a device, or the processor.
    pub machine: String,
}
