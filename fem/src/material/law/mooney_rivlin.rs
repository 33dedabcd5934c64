//! The Mooney–Rivlin law.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::HyperelasticLaw;
use crate::material::{PrincipalStrain, Scalar};

/// Compressible Mooney–Rivlin rubber:
/// ψ = C₁₀ (Ī₁ − 3) + C₀₁ (Ī₂ − 3) + K/4 (J² − 1 − 2 ln J).
///
/// Ī₁ = Σ λ̄_i² and Ī₂ = Σ λ̄_i⁻² belong to F̄ = J^(−1/3) F. With ε̄_i = ln λ̄_i the stress is
/// τ_i = 2 C₁₀ (λ̄_i² − Ī₁/3) − 2 C₀₁ (λ̄_i⁻² − Ī₂/3) + K/2 (J² − 1).
///
/// Small strain: λ̄_i^±2 − 1 = ±2 ε̄_i + 2 ε̄_i² + …, and Σ ε̄_i = 0, so the first two terms are 2 (C₁₀ + C₀₁) Σ
/// ε̄_i². The shear modulus is μ = 2 (C₁₀ + C₀₁); the bulk modulus is K.
///
/// Limits: C₀₁ < 0 is allowed if C₁₀ + C₀₁ > 0, but the law is then unstable at large strain. Rubber has a ratio K/μ
/// of 1000 and more, for which linear tetrahedra lock (are much too stiff).
///
/// References: Mooney, J. Appl. Phys. 11 (1940) 582, doi:10.1063/1.1712836; Rivlin, Phil. Trans.
/// R. Soc. A 241 (1948) 379, doi:10.1098/rsta.1948.0024.
///
/// # Example
/// ```
/// use fem::{Material, MooneyRivlin};
///
/// let rubber = MooneyRivlin { c10_mpa: 0.16, c01_mpa: 0.01, bulk_mpa: 20.0 };
/// let law = Material::hyperelastic(rubber)?.elasticity;
/// let shear = law.young_mpa() / (2.0 * (1.0 + law.poisson()));
/// assert!((shear - 0.34).abs() < 1e-12);
/// # Ok::<(), fem::FemError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MooneyRivlin {
    /// Constant C₁₀, MPa.
    pub c10_mpa: f64,
    /// Constant C₀₁, MPa.
    pub c01_mpa: f64,
    /// Bulk modulus K, MPa.
    pub bulk_mpa: f64,
}

impl HyperelasticLaw for MooneyRivlin {
    #[inline(always)]
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        strain.isochoric_power_sum(2.0) * self.c10_mpa
            + strain.isochoric_power_sum(-2.0) * self.c01_mpa
            + strain.volumetric_energy(self.bulk_mpa)
    }
}
