//! The parameters of one region, with their units.

use super::law::{ElasticLaw, Moduli};
use super::{Damage, Degradation, HyperelasticLaw, PhaseField, PointMaterial, Split, UserLaw};
use crate::error::FemError;

/// The material of one region of the mesh.
///
/// # Example
/// ```
/// use fem::{ElasticLaw, Material};
///
/// let matrix = Material {
///     law: ElasticLaw::Hencky,
///     young_mpa: 275.0,
///     poisson: 0.25,
///     toughness_n_per_mm: Some(0.0025),
///     viscosity_mpa_s: 0.3,
///     residual_stiffness: 0.01,
/// };
/// let steel = Material::elastic(ElasticLaw::Hencky, 210_000.0, 0.3);
/// assert!(steel.toughness_n_per_mm.is_none());
/// # let _ = matrix;
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Elastic law.
    pub law: ElasticLaw,
    /// Young's modulus at small strain, MPa.
    pub young_mpa: f64,
    /// Poisson's ratio at small strain, in (−1, ½).
    pub poisson: f64,
    /// Critical energy release rate Gc, N/mm; `None`: the region stays elastic.
    pub toughness_n_per_mm: Option<f64>,
    /// Viscosity ξ of the damage, MPa s; zero: rate independent.
    pub viscosity_mpa_s: f64,
    /// Share η of the stiffness that full damage leaves, in [0, 1).
    pub residual_stiffness: f64,
}

impl Material {
    /// A material that cannot be damaged.
    pub fn elastic(law: ElasticLaw, young_mpa: f64, poisson: f64) -> Self {
        Self {
            law,
            young_mpa,
            poisson,
            toughness_n_per_mm: None,
            viscosity_mpa_s: 0.0,
            residual_stiffness: 0.0,
        }
    }

    /// An elastic material with a law of one's own; its moduli at small strain are those of the law.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if the energy is not symmetric in the strains, rest is not a state
    /// of zero energy and stress, or a modulus is not positive.
    pub fn hyperelastic(law: impl HyperelasticLaw) -> Result<Self, FemError> {
        let law = UserLaw::new(law);
        let [young, poisson] = law.small_strain()?;
        Ok(Self::elastic(ElasticLaw::User(law), young, poisson))
    }

    pub(crate) fn validate(
        &self,
        region: &str,
        phase_field: Option<&PhaseField>,
    ) -> Result<(), FemError> {
        let entity = format!("material.{region}");
        let check = |holds: bool, field: &'static str, value: f64, requirement: &'static str| {
            if holds {
                Ok(())
            } else {
                Err(FemError::parameter(&entity, field, value, requirement))
            }
        };
        check(positive(self.young_mpa), "young_mpa", self.young_mpa, "a positive modulus in MPa")?;
        check(
            self.poisson > -1.0 && self.poisson < 0.5,
            "poisson",
            self.poisson,
            "between -1 and 0.5, both excluded (0.5 is incompressible: use 0.49)",
        )?;
        if let Some(toughness) = self.toughness_n_per_mm {
            check(
                positive(toughness),
                "toughness_n_per_mm",
                toughness,
                "a positive toughness in N/mm; leave it out for an elastic region",
            )?;
        }
        check(
            self.viscosity_mpa_s >= 0.0 && self.viscosity_mpa_s.is_finite(),
            "viscosity_mpa_s",
            self.viscosity_mpa_s,
            "zero (rate independent) or positive, in MPa s",
        )?;
        check(
            (0.0..1.0).contains(&self.residual_stiffness),
            "residual_stiffness",
            self.residual_stiffness,
            "in [0, 1), usually 0.01",
        )?;
        if let ElasticLaw::User(law) = &self.law {
            let moduli = law.small_strain()?;
            let of_the_law = "the modulus of its law at small strain: leave it as Material::hyperelastic sets it";
            let agrees = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs().max(1e-3);
            check(agrees(self.young_mpa, moduli[0]), "young_mpa", self.young_mpa, of_the_law)?;
            check(agrees(self.poisson, moduli[1]), "poisson", self.poisson, of_the_law)?;
        }
        if phase_field.is_some_and(|p| p.split == Split::Spectral)
            && self.toughness_n_per_mm.is_some()
            && self.law != ElasticLaw::Hencky
        {
            return Err(FemError::Unsupported {
                entity,
                message: "the energy of this law has no spectral split".into(),
                help: "take law = \"hencky\", split = \"volumetric-deviatoric\" or \"none\", or leave \
                       the toughness out"
                    .into(),
            });
        }
        Ok(())
    }

    /// The form that the integration points use.
    pub(crate) fn at_point(&self, phase_field: Option<&PhaseField>) -> PointMaterial {
        let damage = phase_field.zip(self.toughness_n_per_mm).map(|(field, toughness)| {
            let c0 = field.model.normaliser();
            Damage {
                split: field.split,
                hybrid: field.hybrid,
                density: field.model,
                degradation: Degradation { residual: self.residual_stiffness },
                local: toughness / (c0 * field.length_mm),
                gradient: toughness * field.length_mm / c0,
                viscosity: self.viscosity_mpa_s,
            }
        });
        PointMaterial {
            law: self.law.clone(),
            moduli: Moduli::new(self.young_mpa, self.poisson),
            damage,
        }
    }
}

fn positive(x: f64) -> bool {
    x > 0.0 && x.is_finite()
}
