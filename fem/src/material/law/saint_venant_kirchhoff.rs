//! The Saint-Venant–Kirchhoff law.

use super::HyperelasticLaw;
use crate::material::{PrincipalStrain, Scalar};

/// Saint-Venant–Kirchhoff solid: ψ = λ/2 (tr E)² + μ E : E in Green's strain E = ½ (FᵀF − I).
///
/// The second Piola–Kirchhoff stress is S = λ tr E I + 2μ E, so τ_i = (1 + 2 E_i)(λ tr E + 2μ E_i).
///
/// Small strain: E_i = ε_i + ε_i² + …, so ψ = λ/2 (tr ε)² + μ ε : ε to second order. λ and μ are the Lamé constants.
///
/// Limits: ψ stays finite for J → 0, and a bar under uniaxial compression reaches its largest force at the stretch
/// 1/√3 and is unstable below it. The law is suitable for large rotations with small strain, not for crushing.
///
/// Reference: Ciarlet, Mathematical Elasticity I (1988), section 4.4.
///
/// # Example
/// ```
/// use fem::{Material, SaintVenantKirchhoff};
///
/// let law = SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa: 110.0 };
/// let law = Material::hyperelastic(law)?.elasticity;
/// assert!((law.young_mpa() - 275.0).abs() < 1e-10 && (law.poisson() - 0.25).abs() < 1e-12);
/// # Ok::<(), fem::FemError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SaintVenantKirchhoff {
    /// Lamé constant λ, MPa.
    pub lame_mpa: f64,
    /// Shear modulus μ, MPa.
    pub shear_mpa: f64,
}

impl HyperelasticLaw for SaintVenantKirchhoff {
    #[inline(always)]
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let green = strain.green();
        let trace = green[0] + green[1] + green[2];
        let squares = green[0] * green[0] + green[1] * green[1] + green[2] * green[2];
        trace * trace * (self.lame_mpa / 2.0) + squares * self.shear_mpa
    }
}
