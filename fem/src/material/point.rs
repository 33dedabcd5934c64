//! What an element needs from the material at an integration point.

use nalgebra::{Matrix3, Vector3};

use super::kinematics::{Inverted, Principal};
use super::law::{Elasticity, Moduli, Parts};
use super::{CrackDensity, Degradation, Split};

/// One region's constants, ready for the integration points.
#[derive(Clone, Debug)]
pub(crate) struct PointMaterial {
    pub(crate) elasticity: Elasticity,
    pub(crate) moduli: Moduli,
    /// `None`: elastic.
    pub(crate) damage: Option<Damage>,
}

/// The damage constants of a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Damage {
    pub(crate) split: Split,
    /// Whether the split concerns the driving energy only.
    pub(crate) hybrid: bool,
    pub(crate) density: CrackDensity,
    pub(crate) degradation: Degradation,
    /// Gc/(c₀ ℓ₀), MPa.
    pub(crate) local: f64,
    /// Gc ℓ₀/c₀, N.
    pub(crate) gradient: f64,
    /// ξ, MPa s.
    pub(crate) viscosity: f64,
}

/// Stress and tangent at a point for a given g, kept in the principal basis.
#[derive(Clone, Debug)]
pub(crate) struct PointResponse {
    principal: Principal,
    parts: Parts,
    driving: f64,
}

/// The tangent with g applied, in the principal basis.
pub(crate) struct Tangent {
    /// The principal axes, as columns.
    pub(crate) basis: Matrix3<f64>,
    /// A_il of K_ii = Σ_l A_il g_l g′_l.
    diagonal: [[f64; 3]; 3],
    /// D_ij.
    pub(crate) normal: [[f64; 3]; 3],
    /// G_ij at the third index.
    pub(crate) shear: [f64; 3],
    /// τ_i.
    pub(crate) stress: [f64; 3],
}

impl PointMaterial {
    /// The response to the displacement gradient H = F − I.
    pub(crate) fn respond(&self, gradient: &Matrix3<f64>) -> Result<PointResponse, Inverted> {
        let principal = Principal::new(gradient)?;
        let split = self.damage.map_or(Split::None, |d| d.split);
        let mut parts = self.elasticity.respond(split, &self.moduli, principal.strain);
        let driving = parts.plus.energy;
        if self.damage.is_some_and(|d| d.hybrid) {
            parts = parts.merged();
        }
        Ok(PointResponse { principal, parts, driving })
    }
}

impl PointResponse {
    /// ψ⁺, which drives damage.
    pub(crate) fn driving_energy(&self) -> f64 {
        self.driving
    }

    /// g ψ⁺ + ψ⁻.
    pub(crate) fn energy(&self, g: f64) -> f64 {
        g * self.parts.plus.energy + self.parts.minus.energy
    }

    /// τ⁺_i.
    pub(crate) fn stress_plus(&self) -> [f64; 3] {
        self.parts.plus.stress
    }

    /// τ_i of g τ⁺ + τ⁻.
    fn stress(&self, g: f64) -> [f64; 3] {
        std::array::from_fn(|i| g * self.parts.plus.stress[i] + self.parts.minus.stress[i])
    }

    /// F⁻ᵀ G in the principal basis, for a reference gradient G of a shape function.
    #[inline]
    pub(crate) fn spatial(&self, reference: &[f64; 3]) -> [f64; 3] {
        (self.principal.push * Vector3::from(*reference)).into()
    }

    /// The first Piola–Kirchhoff stress P = τ F⁻ᵀ with τ = g τ⁺ + τ⁻, so that R = ∫ P : ∇v dV.
    pub(crate) fn piola(&self, g: f64) -> Matrix3<f64> {
        let scaled = Matrix3::from_diagonal(&self.stress(g).into()) * self.principal.push;
        self.principal.basis * scaled
    }

    /// The first Piola–Kirchhoff stress of the degraded part alone, P⁺ = ∂P/∂g.
    pub(crate) fn piola_plus(&self) -> Matrix3<f64> {
        let scaled = Matrix3::from_diagonal(&self.parts.plus.stress.into()) * self.principal.push;
        self.principal.basis * scaled
    }

    /// The consistent tangent for the given g.
    pub(crate) fn tangent(&self, g: f64) -> Tangent {
        let (plus, minus) = (&self.parts.plus, &self.parts.minus);
        let tau = self.stress(g);
        let normal: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| g * plus.tangent[i][j] + minus.tangent[i][j])
        });
        let shear: [f64; 3] = std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            g * plus.shear[k] + minus.shear[k] - 0.5 * (tau[i] + tau[j])
        });
        let diagonal = std::array::from_fn(|i| {
            std::array::from_fn(|l| {
                if i == l { normal[i][i] - tau[i] } else { shear[3 - i - l] + tau[l] }
            })
        });
        Tangent { basis: self.principal.basis, diagonal, normal, shear, stress: tau }
    }
}

impl Tangent {
    /// The 3 × 3 block ∂R_a/∂u_b per volume, for two spatial gradients in the principal basis.
    ///
    /// With h = ∇δu F⁻¹ and (d)_ii = Σ_j D_ij h_jj − τ_i h_ii, (d)_ij = G_ij (h_ij + h_ji) + h_ij τ_j,
    /// the block is K_ij = δ_ij Σ_l A_il a_l b_l + (1 − δ_ij)(D_ij a_i b_j + G_ij a_j b_i), turned back
    /// to the global axes.
    #[inline]
    pub(crate) fn block(&self, a: &[f64; 3], b: &[f64; 3]) -> Matrix3<f64> {
        let local = Matrix3::from_fn(|i, j| {
            if i == j {
                self.diagonal[i][0] * a[0] * b[0]
                    + self.diagonal[i][1] * a[1] * b[1]
                    + self.diagonal[i][2] * a[2] * b[2]
            } else {
                self.normal[i][j] * a[i] * b[j] + self.shear[3 - i - j] * a[j] * b[i]
            }
        });
        self.basis * local * self.basis.transpose()
    }
}
