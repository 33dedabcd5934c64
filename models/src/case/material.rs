//! The parameters of a region and its elastic law.

use fem::{ElasticLaw, FemError, Fracture, Inelasticity, Material, Strength, Viscoelasticity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::plastic::PlasticCase;

/// `[material.<region>]`: parameters of one region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MaterialCase {
    /// Elastic law.
    #[serde(default)]
    pub law: ElasticLaw,
    /// Young's modulus in MPa; not allowed if the law has its own constants.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 1e7))]
    pub young_mpa: Option<f64>,
    /// Poisson's ratio; not allowed if the law has its own constants.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = -1, "exclusiveMaximum" = 0.5))]
    pub poisson: Option<f64>,
    /// Prony series of the moduli.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub viscoelastic: Option<Viscoelasticity>,
    /// Plastic flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plastic: Option<PlasticCase>,
    /// Critical energy release rate in N/mm; without it, the region is elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-9, max = 1e3))]
    pub toughness_n_per_mm: Option<f64>,
    /// Strength in tension and compression, independent of the toughness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength: Option<Strength>,
    /// Viscosity of the damage in MPa s.
    #[serde(default)]
    #[schemars(range(min = 0, max = 1e4))]
    pub viscosity_mpa_s: f64,
    /// Fraction of the stiffness that remains at full damage.
    #[serde(default = "residual_stiffness")]
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub residual_stiffness: f64,
}

impl MaterialCase {
    /// Converts to the material of `fem`.
    ///
    /// # Errors
    /// If the constants do not describe an elastic solid.
    pub(crate) fn in_fem(&self) -> Result<Material, FemError> {
        // the validation of the case has checked that both values are given if the law needs them
        let [young, poisson] = [self.young_mpa, self.poisson].map(|x| x.unwrap_or(f64::NAN));
        let fracture = self.toughness_n_per_mm.map(|toughness_n_per_mm| Fracture {
            toughness_n_per_mm,
            viscosity_mpa_s: self.viscosity_mpa_s,
            residual_stiffness: self.residual_stiffness,
        });
        let viscous = self.viscoelastic.clone().map(Inelasticity::Viscoelastic);
        let plastic = self.plastic.as_ref().map(|plastic| Inelasticity::Plastic(plastic.in_fem()));
        let inelasticity = viscous.or(plastic);
        let strength = self.strength;
        Ok(Material { fracture, inelasticity, strength, ..self.law.material(young, poisson)? })
    }
}

fn residual_stiffness() -> f64 {
    0.01
}
