//! The elastic laws by the names that a file gives them.

use serde::{Deserialize, Serialize};

use super::law::check_moduli;
use super::{Material, MooneyRivlin, Ogden, SaintVenantKirchhoff};
use crate::error::FemError;

/// An elastic law by name: `"hencky"`, or a name with the constants of the law, as
/// `{ mooney-rivlin = { c10_mpa = 0.16, c01_mpa = 0.01, bulk_mpa = 20.0 } }`.
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
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ElasticLaw {
    /// [`Elasticity::Hencky`](super::Elasticity::Hencky).
    #[default]
    Hencky,
    /// [`Elasticity::NeoHookean`](super::Elasticity::NeoHookean).
    NeoHookean,
    /// [`SaintVenantKirchhoff`] of these moduli.
    SaintVenantKirchhoff,
    /// [`MooneyRivlin`], which has constants of its own.
    MooneyRivlin(MooneyRivlin),
    /// [`Ogden`], which has constants of its own.
    Ogden(Ogden),
}

impl ElasticLaw {
    /// Whether the law has constants of its own in place of Young's modulus and Poisson's ratio.
    pub fn has_constants(&self) -> bool {
        matches!(self, Self::MooneyRivlin(_) | Self::Ogden(_))
    }

    /// The elastic material of this law; one with constants of its own passes over the moduli (MPa
    /// and none).
    ///
    /// # Errors
    /// [`FemError::Parameter`] for moduli or an exponent out of range, [`FemError::Unsupported`] for
    /// constants that make no elastic solid.
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
                    let requirement = "another number: a term of exponent zero has no energy";
                    return Err(FemError::parameter("law", "alpha", term.alpha, requirement));
                }
                Material::hyperelastic(law.clone())
            }
        }
    }
}
