//! Parameters of the material of one region, with their units.

use std::fmt;

use super::crack_density::CrackDensity;
use super::degradation::{DegradationFunction, DegradationLaw, UserDegradation};
use super::inelastic::{Inelasticity, Plasticity, Viscoelasticity};
use super::law::{
    ConstitutiveLaw, Elasticity, HyperelasticLaw, Moduli, UserConstitutiveLaw, UserLaw,
    check_moduli,
};
use super::phase_field::{Irreversibility, PhaseField};
use super::point::{Damage, PointMaterial};
use super::split::{Degraded, EnergySplit, PointSplit, Split, UserSplit};
use super::strength::{Strength, StrengthContext};
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
#[derive(Clone, PartialEq)]
pub struct Material {
    /// Elastic law and moduli.
    pub elasticity: Elasticity,
    /// Viscous or plastic part of the law; `None`: the law is elastic, or a user-defined law with a state.
    pub inelasticity: Option<Inelasticity>,
    /// Resistance to damage; `None`: the region stays elastic.
    pub fracture: Option<Fracture>,
    /// Strength that is independent of the toughness; `None`: the strength follows from E, Gc and ℓ₀.
    pub strength: Option<Strength>,
    /// User-defined split; `None`: [`PhaseField::split`].
    pub split: Option<UserSplit>,
    /// User-defined degradation function; `None`: (1 − φ)².
    pub degradation: Option<UserDegradation>,
}

/// The text identifies the material in checkpoints. An absent inelastic part is omitted, and so are a split and a
/// degradation function that are not user-defined.
impl fmt::Debug for Material {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { elasticity, inelasticity, fracture, strength, split, degradation } = self;
        let mut text = f.debug_struct("Material");
        text.field("elasticity", elasticity).field("fracture", fracture);
        if let Some(inelasticity) = inelasticity {
            text.field("inelasticity", inelasticity);
        }
        if let Some(strength) = strength {
            text.field("strength", strength);
        }
        if let Some(split) = split {
            text.field("split", split);
        }
        if let Some(degradation) = degradation {
            text.field("degradation", degradation);
        }
        text.finish()
    }
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
    /// Creates rate-independent fracture without residual stiffness.
    pub fn new(toughness_n_per_mm: f64) -> Self {
        Self { toughness_n_per_mm, viscosity_mpa_s: 0.0, residual_stiffness: 0.0 }
    }

    /// Checks that each constant lies in its plausible range.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the constant.
    pub fn validate(&self, region: &str) -> Result<(), FemError> {
        let Self { toughness_n_per_mm, viscosity_mpa_s, residual_stiffness } = *self;
        let requirements = [
            (
                (1e-9..=1e3).contains(&toughness_n_per_mm),
                "toughness_n_per_mm",
                toughness_n_per_mm,
                "a positive toughness in N/mm, from 1e-9 to 1e3; leave it out for an elastic region",
            ),
            (
                (0.0..=1e4).contains(&viscosity_mpa_s),
                "viscosity_mpa_s",
                viscosity_mpa_s,
                "zero (rate independent) or positive, in MPa s, at most 1e4",
            ),
            (
                (0.0..1.0).contains(&residual_stiffness),
                "residual_stiffness",
                residual_stiffness,
                "in [0, 1), usually 0.01",
            ),
        ];
        match requirements.into_iter().find(|(holds, ..)| !holds) {
            None => Ok(()),
            Some((_, field, value, requirement)) => {
                Err(FemError::parameter(&format!("material.{region}"), field, value, requirement))
            }
        }
    }
}

impl Material {
    /// Creates an elastic material with Hencky's law.
    pub fn hencky(young_mpa: f64, poisson: f64) -> Self {
        Self::elastic(Elasticity::Hencky { young_mpa, poisson })
    }

    /// Creates an elastic neo-Hookean material.
    pub fn neo_hookean(young_mpa: f64, poisson: f64) -> Self {
        Self::elastic(Elasticity::NeoHookean { young_mpa, poisson })
    }

    /// Creates an elastic material with a user-defined law. The moduli at small strain follow from the law.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if the energy is not symmetric in the strains, energy or stress is not zero at rest,
    /// or a modulus is not positive.
    pub fn hyperelastic(law: impl HyperelasticLaw) -> Result<Self, FemError> {
        Ok(Self::elastic(Elasticity::User(UserLaw::new(law)?)))
    }

    /// Creates a material with a user-defined law that may have a state.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if energy or stress at rest is not zero, or the law has too many state values.
    pub fn with_law(law: impl ConstitutiveLaw) -> Result<Self, FemError> {
        Ok(Self::elastic(Elasticity::Constitutive(UserConstitutiveLaw::new(law)?)))
    }

    fn elastic(elasticity: Elasticity) -> Self {
        Self {
            elasticity,
            inelasticity: None,
            fracture: None,
            strength: None,
            split: None,
            degradation: None,
        }
    }

    /// Returns the material with Prony series for its elastic law.
    pub fn with_viscoelasticity(self, series: Viscoelasticity) -> Self {
        Self { inelasticity: Some(Inelasticity::Viscoelastic(series)), ..self }
    }

    /// Returns the material with plastic flow. The elastic law must be Hencky's.
    pub fn with_plasticity(self, plasticity: Plasticity) -> Self {
        Self { inelasticity: Some(Inelasticity::Plastic(plasticity)), ..self }
    }

    /// Returns the material with the relaxation times at a temperature in °C.
    pub fn at_temperature(mut self, celsius: f64) -> Self {
        if let Some(Inelasticity::Viscoelastic(series)) = self.inelasticity {
            let series = series.at_temperature(celsius);
            self.inelasticity = Some(Inelasticity::Viscoelastic(series));
        }
        self
    }

    /// Returns the material with a user-defined split, which replaces [`PhaseField::split`] in the regions of the
    /// material.
    pub fn with_split(self, split: impl EnergySplit) -> Self {
        Self { split: Some(UserSplit::new(split)), ..self }
    }

    /// Returns the material with a user-defined degradation function.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if the function does not decrease from one to zero.
    pub fn with_degradation(self, function: impl DegradationFunction) -> Result<Self, FemError> {
        Ok(Self { degradation: Some(UserDegradation::new(function)?), ..self })
    }

    /// Returns the material with a strength in tension and compression. The material needs a resistance to damage, AT1,
    /// and a residual stiffness.
    pub fn with_strength(self, strength: Strength) -> Self {
        Self { strength: Some(strength), ..self }
    }

    /// Returns the number of state values of the law at an integration point.
    pub fn state_len(&self) -> usize {
        match (&self.inelasticity, &self.elasticity) {
            (Some(law), _) => law.state_len(),
            (None, Elasticity::Constitutive(law)) => law.state_len(),
            _ => 0,
        }
    }

    /// Returns whether the law may be the law of a mixture's matrix: an elastic law, or Prony series of the shear
    /// modulus alone. For other laws, the strain of the matrix does not follow from the strain of the mixture.
    pub(crate) fn is_mixable(&self) -> bool {
        match &self.inelasticity {
            None => true,
            Some(Inelasticity::Viscoelastic(series)) => series.bulk.is_empty(),
            Some(Inelasticity::Plastic(_)) => false,
        }
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
        check_moduli(&entity, self.elasticity.young_mpa(), self.elasticity.poisson())?;
        self.validate_inelasticity(&entity, phase_field)?;
        let Some(fracture) = &self.fracture else {
            return self.validate_strength(&entity, phase_field);
        };
        fracture.validate(region)?;
        self.validate_strength(&entity, phase_field)?;
        phase_field.map_or(Ok(()), |field| self.validate_split(entity, field))
    }

    /// Checks the inelastic part, and that the elastic law and the split support it.
    fn validate_inelasticity(
        &self,
        entity: &str,
        phase_field: Option<&PhaseField>,
    ) -> Result<(), FemError> {
        let refuse = |reason| Err(FemError::unsupported(entity, reason));
        let Some(inelasticity) = &self.inelasticity else { return Ok(()) };
        match (inelasticity, &self.elasticity) {
            (Inelasticity::Plastic(law), Elasticity::Hencky { .. }) => law.validate(entity)?,
            (Inelasticity::Plastic(_), _) => return refuse(Unsupported::PlasticLaw),
            (Inelasticity::Viscoelastic(series), Elasticity::Hencky { .. }) => {
                series.validate(entity)?;
            }
            (Inelasticity::Viscoelastic(series), Elasticity::User(law)) if law.is_decoupled() => {
                series.validate(entity)?;
            }
            (Inelasticity::Viscoelastic(_), _) => return refuse(Unsupported::ViscoelasticLaw),
        }
        let spectral = phase_field.is_some_and(|field| field.split == Split::Spectral);
        if self.fracture.is_some() && (spectral || self.split.is_some()) {
            return refuse(Unsupported::SplitOfInelasticLaw);
        }
        let hybrid = phase_field.is_some_and(|field| field.hybrid && field.split != Split::None);
        if self.fracture.is_some() && hybrid {
            return refuse(Unsupported::SplitOfInelasticLaw);
        }
        Ok(())
    }

    /// Checks the strength, and that law, split and phase field support it.
    fn validate_strength(
        &self,
        entity: &str,
        phase_field: Option<&PhaseField>,
    ) -> Result<(), FemError> {
        let refuse = |reason| Err(FemError::unsupported(entity, reason));
        let Some(strength) = &self.strength else { return Ok(()) };
        strength.validate(entity)?;
        let Some(fracture) = &self.fracture else {
            return refuse(Unsupported::StrengthWithoutToughness);
        };
        if self.inelasticity.is_some() || matches!(self.elasticity, Elasticity::Constitutive(_)) {
            return refuse(Unsupported::StrengthOfInelasticLaw);
        }
        if self.split.is_some() || self.degradation.is_some() {
            return refuse(Unsupported::StrengthOfField);
        }
        if fracture.residual_stiffness < 1e-8 {
            let (field, value) = ("residual_stiffness", fracture.residual_stiffness);
            let requirement = "at least 1e-8 for a material with a strength, usually 1e-4";
            return Err(FemError::parameter(entity, field, value, requirement));
        }
        let Some(field) = phase_field else { return Ok(()) };
        let is_supported = field.model == CrackDensity::At1
            && field.split == Split::None
            && field.irreversibility != Irreversibility::History;
        if !is_supported {
            return refuse(Unsupported::StrengthOfField);
        }
        let (young, toughness) = (self.elasticity.young_mpa(), fracture.toughness_n_per_mm);
        let largest_mm = strength.largest_length_mm(young, toughness);
        if field.length_mm >= largest_mm {
            let length_mm = field.length_mm;
            return refuse(Unsupported::StrengthLength { length_mm, largest_mm });
        }
        Ok(())
    }

    /// Returns the data from which the constants of a strength are computed, for damage with the given settings.
    /// `spacing_mm` is the mean distance of neighbouring nodes of the mesh. If the strength states a spacing, the stated
    /// spacing replaces `spacing_mm`.
    pub fn strength_context(&self, field: &PhaseField, spacing_mm: f64) -> StrengthContext {
        let elasticity = &self.elasticity;
        let moduli = Moduli::new(elasticity.young_mpa(), elasticity.poisson());
        StrengthContext {
            toughness_n_per_mm: self.fracture.map_or(0.0, |f| f.toughness_n_per_mm),
            length_mm: field.length_mm,
            young_mpa: elasticity.young_mpa(),
            bulk_mpa: moduli.bulk,
            spacing_mm: self.strength.and_then(|s| s.node_spacing_mm).unwrap_or(spacing_mm),
        }
    }

    /// Checks that the law supports the split.
    fn validate_split(&self, entity: String, field: &PhaseField) -> Result<(), FemError> {
        let refuse = |reason| Err(FemError::unsupported(entity, reason));
        if self.split.is_some() && field.hybrid {
            return refuse(Unsupported::HybridUserSplit);
        }
        match (&self.elasticity, &self.split, field.split) {
            (Elasticity::Constitutive(_), Some(_), _)
            | (Elasticity::Constitutive(_), None, Split::VolumetricDeviatoric | Split::Spectral) => {
                refuse(Unsupported::SplitOfOwnLaw)
            }
            (Elasticity::NeoHookean { .. } | Elasticity::User(_), None, Split::Spectral) => {
                refuse(Unsupported::SpectralSplit)
            }
            _ => Ok(()),
        }
    }

    /// Returns the material in the form used at quadrature points, without the correction of a strength for the mesh.
    pub fn at_point(&self, phase_field: Option<&PhaseField>) -> PointMaterial {
        self.at_point_of(phase_field, 0.0)
    }

    /// Returns the material in the form used at quadrature points of a mesh with this distance of nodes in mm.
    pub fn at_point_of(&self, phase_field: Option<&PhaseField>, spacing_mm: f64) -> PointMaterial {
        let damage = phase_field.zip(self.fracture).map(|(field, fracture)| {
            let c0 = field.model.normaliser();
            let split = match &self.split {
                Some(split) => PointSplit::User(split.clone()),
                None => PointSplit::Standard(field.split),
            };
            let degradation = match &self.degradation {
                Some(function) => DegradationLaw::User(function.clone()),
                None => DegradationLaw::Quadratic,
            };
            let constants = self
                .strength
                .map(|strength| strength.constants(&self.strength_context(field, spacing_mm)));
            let factor = constants.map_or(1.0, |constants| constants.toughness_factor);
            let toughness = factor * fracture.toughness_n_per_mm;
            Damage {
                strength: constants.map(|constants| constants.drive),
                degraded: Degraded { split, hybrid: field.hybrid },
                energies: field.energies(),
                degradation,
                density: field.model,
                history: field.irreversibility == Irreversibility::History,
                residual: fracture.residual_stiffness,
                local: toughness / (c0 * field.length_mm),
                gradient: toughness * field.length_mm / c0,
                viscosity: fracture.viscosity_mpa_s,
            }
        });
        let moduli = Moduli::new(self.elasticity.young_mpa(), self.elasticity.poisson());
        let inelastic = self.inelasticity.clone().map(Inelasticity::sorted);
        PointMaterial { elasticity: self.elasticity.clone(), moduli, inelastic, damage }
    }
}
