//! The parameters of a region and its elastic law.

use fem::{FemError, Fracture, Material, MooneyRivlin, Ogden, SaintVenantKirchhoff};
use serde::{Deserialize, Serialize};

/// `[material.<region>]`: one region's parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialCase {
    /// Elastic law.
    #[serde(default)]
    pub law: LawCase,
    /// Young's modulus in MPa; not for a law with constants of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young_mpa: Option<f64>,
    /// Poisson's ratio; not for a law with constants of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Critical energy release rate in N/mm; without it the region is elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub toughness_n_per_mm: Option<f64>,
    /// Viscosity of the damage in MPa s.
    #[serde(default)]
    pub viscosity_mpa_s: f64,
    /// Fraction of the stiffness that full damage leaves.
    #[serde(default = "residual_stiffness")]
    pub residual_stiffness: f64,
}

/// Elastic laws: a name, or a name with the constants of the law.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum LawCase {
    /// Quadratic in the logarithmic strain.
    #[default]
    Hencky,
    /// Compressible neo-Hookean.
    NeoHookean,
    /// Quadratic in Green's strain.
    SaintVenantKirchhoff,
    /// Linear in the invariants of the isochoric stretch.
    MooneyRivlin {
        /// C₁₀ in MPa.
        c10_mpa: f64,
        /// C₀₁ in MPa.
        c01_mpa: f64,
        /// Bulk modulus in MPa.
        bulk_mpa: f64,
    },
    /// Powers of the isochoric stretches.
    Ogden {
        /// The terms.
        terms: Vec<OgdenTermCase>,
        /// Bulk modulus in MPa.
        bulk_mpa: f64,
    },
}

/// A term μ/α Σ λ̄^α of Ogden's energy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OgdenTermCase {
    /// μ in MPa.
    pub mu_mpa: f64,
    /// α.
    pub alpha: f64,
}

impl LawCase {
    /// Whether the law has constants of its own in place of Young's modulus and Poisson's ratio.
    pub fn has_constants(&self) -> bool {
        matches!(self, Self::MooneyRivlin { .. } | Self::Ogden { .. })
    }
}

impl MaterialCase {
    /// The material as `fem` takes it.
    ///
    /// # Errors
    /// Constants that make no elastic solid.
    pub(crate) fn in_fem(&self) -> Result<Material, FemError> {
        // asked for by the case's validation wherever the law takes them
        let [young, poisson] = [self.young_mpa, self.poisson].map(|x| x.unwrap_or(f64::NAN));
        let elastic = match &self.law {
            LawCase::Hencky => Material::hencky(young, poisson),
            LawCase::NeoHookean => Material::neo_hookean(young, poisson),
            LawCase::SaintVenantKirchhoff => {
                let shear_mpa = young / (2.0 * (1.0 + poisson));
                let lame_mpa = 2.0 * shear_mpa * poisson / (1.0 - 2.0 * poisson);
                Material::hyperelastic(SaintVenantKirchhoff { lame_mpa, shear_mpa })?
            }
            &LawCase::MooneyRivlin { c10_mpa, c01_mpa, bulk_mpa } => {
                Material::hyperelastic(MooneyRivlin { c10_mpa, c01_mpa, bulk_mpa })?
            }
            LawCase::Ogden { terms, bulk_mpa } => Material::hyperelastic(Ogden {
                terms: terms.iter().map(|term| (term.mu_mpa, term.alpha)).collect(),
                bulk_mpa: *bulk_mpa,
            })?,
        };
        let fracture = self.toughness_n_per_mm.map(|toughness_n_per_mm| Fracture {
            toughness_n_per_mm,
            viscosity_mpa_s: self.viscosity_mpa_s,
            residual_stiffness: self.residual_stiffness,
        });
        Ok(Material { fracture, ..elastic })
    }
}

fn residual_stiffness() -> f64 {
    0.01
}
