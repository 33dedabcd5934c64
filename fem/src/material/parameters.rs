//! Parameters of the material of one region, with their units.

use super::law::{Elasticity, HyperelasticLaw, Moduli, UserLaw, check_moduli};
use super::phase_field::{Irreversibility, PhaseField, Split};
use super::point::{Damage, Degraded, PointMaterial};
use crate::error::{FemError, Unsupported};

/// The material of one region of the mesh.
///
/// # Example
/// ```
/// use fem::{Fracture, Material};
///
/// let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
///     toughness_n_per_mm: 0.0025,
///     viscosity_mpa_s: 0.3,
///     residual_stiffness: 0.01,
/// });
/// let steel = Material::hencky(210_000.0, 0.3);
/// assert!(matrix.fracture.is_some() && steel.fracture.is_none());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Elastic law and moduli.
    pub elasticity: Elasticity,
    /// Resistance to damage; `None`: the region stays elastic.
    pub fracture: Option<Fracture>,
}

/// Resistance of a region to damage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fracture {
    /// Critical energy release rate Gc, N/mm.
    pub toughness_n_per_mm: f64,
    /// Viscosity ξ of the damage, MPa s; zero: rate independent.
    pub viscosity_mpa_s: f64,
    /// Fraction η of the stiffness that remains at full damage, in [0, 1).
    pub residual_stiffness: f64,
}

impl Fracture {
    /// Rate-independent fracture without residual stiffness.
    pub fn new(toughness_n_per_mm: f64) -> Self {
        Self { toughness_n_per_mm, viscosity_mpa_s: 0.0, residual_stiffness: 0.0 }
    }
}

impl Material {
    /// Creates an elastic material with Hencky's law.
    pub fn hencky(young_mpa: f64, poisson: f64) -> Self {
        Self { elasticity: Elasticity::Hencky { young_mpa, poisson }, fracture: None }
    }

    /// Creates an elastic neo-Hookean material.
    pub fn neo_hookean(young_mpa: f64, poisson: f64) -> Self {
        Self { elasticity: Elasticity::NeoHookean { young_mpa, poisson }, fracture: None }
    }

    /// Creates an elastic material with a user-defined law. Its moduli at small strain follow from the law.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if the energy is not symmetric in the strains, energy or stress is not zero at rest,
    /// or a modulus is not positive.
    pub fn hyperelastic(law: impl HyperelasticLaw) -> Result<Self, FemError> {
        Ok(Self { elasticity: Elasticity::User(UserLaw::new(law)?), fracture: None })
    }

    /// Returns the material with a resistance to damage.
    pub fn with_fracture(self, fracture: Fracture) -> Self {
        Self { fracture: Some(fracture), ..self }
    }

    /// Checks that the parameters are valid and in plausible units, and that the law supports the split.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the parameter; [`FemError::Unsupported`] for an unsupported split.
    pub fn validate(&self, region: &str, phase_field: Option<&PhaseField>) -> Result<(), FemError> {
        let entity = format!("material.{region}");
        let check = |holds: bool, field: &'static str, value: f64, requirement: &'static str| {
            if holds {
                Ok(())
            } else {
                Err(FemError::parameter(&entity, field, value, requirement))
            }
        };
        check_moduli(&entity, self.elasticity.young_mpa(), self.elasticity.poisson())?;
        let Some(fracture) = &self.fracture else { return Ok(()) };
        check(
            (1e-9..=1e3).contains(&fracture.toughness_n_per_mm),
            "toughness_n_per_mm",
            fracture.toughness_n_per_mm,
            "a positive toughness in N/mm, from 1e-9 to 1e3; leave it out for an elastic region",
        )?;
        check(
            (0.0..=1e4).contains(&fracture.viscosity_mpa_s),
            "viscosity_mpa_s",
            fracture.viscosity_mpa_s,
            "zero (rate independent) or positive, in MPa s, at most 1e4",
        )?;
        check(
            (0.0..1.0).contains(&fracture.residual_stiffness),
            "residual_stiffness",
            fracture.residual_stiffness,
            "in [0, 1), usually 0.01",
        )?;
        if phase_field.is_some_and(|p| p.split == Split::Spectral)
            && !matches!(self.elasticity, Elasticity::Hencky { .. })
        {
            return Err(FemError::unsupported(entity, Unsupported::SpectralSplit));
        }
        Ok(())
    }

    /// Returns the material in the form used at quadrature points.
    pub fn at_point(&self, phase_field: Option<&PhaseField>) -> PointMaterial {
        let damage = phase_field.zip(self.fracture).map(|(field, fracture)| {
            let c0 = field.model.normaliser();
            Damage {
                degraded: Degraded { split: field.split, hybrid: field.hybrid },
                density: field.model,
                history: field.irreversibility == Irreversibility::History,
                residual: fracture.residual_stiffness,
                local: fracture.toughness_n_per_mm / (c0 * field.length_mm),
                gradient: fracture.toughness_n_per_mm * field.length_mm / c0,
                viscosity: fracture.viscosity_mpa_s,
            }
        });
        let moduli = Moduli::new(self.elasticity.young_mpa(), self.elasticity.poisson());
        PointMaterial { elasticity: self.elasticity.clone(), moduli, damage }
    }
}
