//! Points of a curve, and derivatives of the force.

use serde::{Deserialize, Serialize};

/// One converged load step. Compression is positive.
///
/// A point is deserialised by the names of the fields or by the names of the columns of a curve file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Time, s.
    pub time_s: f64,
    /// Displacement of the measured surface, mm; in a compression test the downward displacement of the upper platen.
    pub displacement_mm: f64,
    /// Force on the body through the measured surface, N: from prescribed values, a platen and tractions.
    #[serde(alias = "force_N")]
    pub force_n: f64,
    /// Elastic energy ∫ (g ψ⁺ + ψ⁻) dV, N mm: g is the degradation, ψ⁺ and ψ⁻ are the degraded and the intact part of
    /// the energy density.
    #[serde(alias = "elastic_N_mm")]
    pub elastic_n_mm: f64,
    /// Crack energy ∫ Gc/(c₀ ℓ₀) (α(φ) + ℓ₀² |∇φ|²) dV, N mm: toughness Gc, length scale ℓ₀, local crack density α, its
    /// normalisation c₀.
    #[serde(alias = "fracture_N_mm")]
    pub fracture_n_mm: f64,
    /// Energy dissipated by the viscosity ξ of damage so far, ∫∫ ξ φ̇² dV dt, N mm.
    #[serde(alias = "viscous_N_mm")]
    pub viscous_n_mm: f64,
    /// Whether the load program prescribed the force in the step that ended at this point. The displacement is then a
    /// result. Curve files do not contain this value.
    #[serde(default)]
    pub force_is_prescribed: bool,
    /// Energy dissipated by friction and drag at the platens so far, N mm.
    #[serde(default, alias = "friction_N_mm")]
    pub friction_n_mm: f64,
    /// Work of loads, supports and prescribed damage so far, N mm: ∫ F du, integrated by the trapezoid rule.
    #[serde(default, alias = "work_N_mm")]
    pub work_n_mm: f64,
    /// Mean damage over the volume of the regions that have a toughness.
    pub phi_mean: f64,
    /// Largest nodal damage.
    pub phi_max: f64,
    /// Newton iterations of the step, including failed attempts.
    #[serde(default)]
    pub newton: u32,
    /// Iterations of the linear solver in the step, including failed attempts.
    #[serde(default)]
    pub linear: u32,
    /// Residual at the end of the step: the larger of the force residual relative to the largest reactions so far,
    /// and the damage residual relative to the largest driving force so far.
    #[serde(default)]
    pub residual: f64,
}

impl CurvePoint {
    /// Whether all values are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let Self { time_s, displacement_mm, force_n, elastic_n_mm, fracture_n_mm, .. } = *self;
        let Self { viscous_n_mm, friction_n_mm, work_n_mm, phi_mean, phi_max, residual, .. } =
            *self;
        [time_s, displacement_mm, force_n, elastic_n_mm, fracture_n_mm, viscous_n_mm]
            .into_iter()
            .chain([friction_n_mm, work_n_mm, phi_mean, phi_max, residual])
            .all(f64::is_finite)
    }

    /// Returns work minus stored and dissipated energy, N mm.
    ///
    /// The balance is zero for the exact solution. With the backward Euler rule, the balance is O(Δt) and has constant
    /// sign.
    pub fn balance_n_mm(&self) -> f64 {
        let dissipated = self.fracture_n_mm + self.viscous_n_mm + self.friction_n_mm;
        self.work_n_mm - self.elastic_n_mm - dissipated
    }
}

/// Derivatives of the force, or of the displacement if the force is prescribed, with respect to material parameters at the
/// points of a curve, at fixed time and prescribed load. Enabled by [`Problem::with_sensitivities`](crate::Problem::with_sensitivities).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensitivities {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// ∂F/∂θ, in N per unit of the parameter: one row per point of the curve, one column per parameter. If the
    /// derivatives at a point could not be computed, the rows of this point and of all later points are missing.
    pub force_n: Vec<Vec<f64>>,
    /// ∂u/∂θ of the displacement of the platen, in mm per unit of the parameter, in the same form. Empty unless the load
    /// program prescribes a force: the displacement of the platen is otherwise given.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displacement_mm: Vec<Vec<f64>>,
    /// Reason why rows are missing, usually a singular tangent at the first point without a row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<String>,
}

impl Sensitivities {
    /// Whether there are no parameters.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }
}
