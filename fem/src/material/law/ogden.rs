//! Ogden's law.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::HyperelasticLaw;
use crate::material::{PrincipalStrain, Scalar};

/// Compressible Ogden rubber: ψ = Σ_p μ_p/α_p Σ_i (λ̄_i^α_p − 1) + K/4 (J² − 1 − 2 ln J).
///
/// λ̄_i = J^(−1/3) λ_i. The stress is τ_i = Σ_p μ_p (λ̄_i^α_p − ⅓ Σ_j λ̄_j^α_p) + K/2 (J² − 1).
///
/// Small strain: λ̄^α − 1 = α ε̄ + ½ α² ε̄² + … and Σ ε̄_i = 0, so ψ is ½ Σ_p μ_p α_p Σ_i ε̄_i² plus the volumetric
/// term. The shear modulus is μ = ½ Σ_p μ_p α_p; the bulk modulus is K.
///
/// Limits: terms with μ_p α_p > 0 are stable. The Mooney–Rivlin law has the two terms α₁ = 2, μ₁ = 2 C₁₀ and α₂ = −2,
/// μ₂ = −2 C₀₁. An exponent of zero is rejected, because its energy is not finite.
///
/// Reference: Ogden, Proc. R. Soc. A 326 (1972) 565, doi:10.1098/rspa.1972.0026.
///
/// # Example
/// Ogden's three terms for Treloar's rubber:
/// ```
/// use fem::{Material, Ogden, OgdenTerm};
///
/// let terms = [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)];
/// let terms = terms.map(OgdenTerm::from).to_vec();
/// let law = Material::hyperelastic(Ogden { terms, bulk_mpa: 40.0 })?.elasticity;
/// let shear = law.young_mpa() / (2.0 * (1.0 + law.poisson()));
/// assert!((shear - 0.4225).abs() < 1e-12);
/// # Ok::<(), fem::FemError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ogden {
    /// Terms of the sum.
    pub terms: Vec<OgdenTerm>,
    /// Bulk modulus K, MPa.
    pub bulk_mpa: f64,
}

/// A term μ/α Σ (λ̄^α − 1) of [`Ogden`]'s energy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OgdenTerm {
    /// Coefficient μ, MPa.
    pub mu_mpa: f64,
    /// Exponent α, not zero.
    pub alpha: f64,
}

impl From<(f64, f64)> for OgdenTerm {
    /// Creates a term from μ (MPa) and α.
    fn from((mu_mpa, alpha): (f64, f64)) -> Self {
        Self { mu_mpa, alpha }
    }
}

impl HyperelasticLaw for Ogden {
    #[inline(always)]
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let mut energy = strain.volumetric_energy(self.bulk_mpa);
        for term in &self.terms {
            energy += strain.isochoric_power_sum(term.alpha) * (term.mu_mpa / term.alpha);
        }
        energy
    }
}
