//! Elastic laws with their names in files.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MooneyRivlin, Ogden, SaintVenantKirchhoff, check_moduli};
use crate::error::FemError;
use crate::material::Material;

/// Elastic law as written in a file: `"hencky"`, or a name with the constants of the law, such as `{ mooney-rivlin =
/// { c10_mpa = 0.16, c01_mpa = 0.01, bulk_mpa = 20.0 } }`.
///
/// # Example
/// ```
/// use fem::ElasticLaw;
///
/// let material = ElasticLaw::NeoHookean.material(275.0, 0.25)?;
/// assert_eq!(material.elasticity.young_mpa(), 275.0);
/// assert!(ElasticLaw::SaintVenantKirchhoff.material(275.0, 0.5).is_err());
/// # Ok::<(), fem::FemError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ElasticLaw {
    /// Hencky's law, linear in the logarithmic strain: [`Elasticity::Hencky`](crate::Elasticity::Hencky).
    #[default]
    Hencky,
    /// Neo-Hookean solid: [`Elasticity::NeoHookean`](crate::Elasticity::NeoHookean).
    NeoHookean,
    /// [`SaintVenantKirchhoff`] with the given Young's modulus and Poisson's ratio.
    SaintVenantKirchhoff,
    /// [`MooneyRivlin`] with its own constants.
    MooneyRivlin(MooneyRivlin),
    /// [`Ogden`] with its own constants.
    Ogden(Ogden),
}

impl ElasticLaw {
    /// Returns whether the law has its own constants instead of Young's modulus and Poisson's ratio.
    pub fn has_constants(&self) -> bool {
        matches!(self, Self::MooneyRivlin(_) | Self::Ogden(_))
    }

    /// Creates the elastic material of this law from Young's modulus (MPa) and Poisson's ratio. A law with its own
    /// constants ignores both.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for a modulus, a Poisson's ratio or an exponent out of range,
    /// [`FemError::Unsupported`] for constants that do not define an elastic solid.
    pub fn material(&self, young_mpa: f64, poisson: f64) -> Result<Material, FemError> {
        if !self.has_constants() {
            check_moduli("material", young_mpa, poisson)?;
        }
        match self {
            Self::Hencky => Ok(Material::hencky(young_mpa, poisson)),
            Self::NeoHookean => Ok(Material::neo_hookean(young_mpa, poisson)),
            Self::SaintVenantKirchhoff => {
                let shear_mpa = young_mpa / (2.0 * (1.0 + poisson));
                let lame_mpa = 2.0 * shear_mpa * poisson / (1.0 - 2.0 * poisson);
                Material::hyperelastic(SaintVenantKirchhoff { lame_mpa, shear_mpa })
            }
            Self::MooneyRivlin(law) => Material::hyperelastic(*law),
            Self::Ogden(law) => {
                if let Some(term) = law.terms.iter().find(|term| term.alpha == 0.0) {
                    let requirement = "nonzero: a term with exponent zero has no energy";
                    return Err(FemError::parameter("law", "alpha", term.alpha, requirement));
                }
                Material::hyperelastic(law.clone())
            }
        }
    }
}
