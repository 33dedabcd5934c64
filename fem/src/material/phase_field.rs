//! Settings of the damage model, common to all regions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::crack_density::CrackDensity;
use super::split::Split;
use crate::error::FemError;

/// Condition that prevents cracks from healing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Irreversibility {
    /// No condition: damage decreases when its driving energy decreases.
    #[default]
    None,
    /// The largest ψ⁺ that a point has reached so far drives its damage. Damage with a history minimises no energy,
    /// and the solver alternates between displacement and damage.
    ///
    /// Reference: Miehe, Hofacker & Welschinger (2010), as for [`Split::Spectral`].
    History,
    /// φ ≥ φ_n at every node, where φ_n is the damage at the end of the last increment; enforced by an active set.
    ///
    /// Reference: Heister, Wheeler & Wick, Comput. Methods Appl. Mech. Engrg. 290 (2015) 466,
    /// doi:10.1016/j.cma.2015.03.009.
    ActiveSet,
}

/// Quadrature rule of the damage terms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DamageQuadrature {
    /// `Vertex` if ℓ₀ is less than twice the mean distance of nodes on an edge (linear elements: the edge length;
    /// quadratic elements: half of the edge length). `Vertex` also for AT1 in quadratic elements, where Gauss points
    /// would damage the vertices of an unloaded body. `Consistent` otherwise.
    #[default]
    Auto,
    /// Points at the nodes (quadratic elements: at the vertices of their eight sub-tetrahedra). This rule keeps φ < 1
    /// if ℓ₀ is below the element size; an element is then degraded by the mean of g. φ may become slightly negative
    /// next to damaged nodes, where the gradient term couples the ends of an edge with the wrong sign (dihedral
    /// angles above 90°; at worst −0.07 on the meshes tested). [`Irreversibility::ActiveSet`] keeps φ ≥ 0, and so
    /// does AT1.
    Vertex,
    /// Gauss points of positive weight, which integrate φ² exactly: four in linear elements, fourteen
    /// in quadratic elements.
    Consistent,
    /// As `Consistent`, but with eleven points in quadratic elements, the smallest number that integrates φ² exactly.
    /// One point has a negative weight and contributes negative energy: use this rule only for smooth fields on fine
    /// meshes.
    Eleven,
}

/// Kinds of energy of a material, as a set: `["elastic", "viscous"]` in files.
///
/// The elastic energy is the energy of the elastic law and, in a viscoelastic material, of the equilibrium spring; it is
/// always in the set. The viscous energy is the energy stored in the Prony terms, the plastic energy is the plastic work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Vec<EnergyKind>", into = "Vec<EnergyKind>")]
pub struct EnergySet {
    /// Whether the set contains the viscous energy.
    pub viscous: bool,
    /// Whether the set contains the plastic energy.
    pub plastic: bool,
}

/// Name of a kind of energy in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EnergyKind {
    /// Energy of the elastic law.
    Elastic,
    /// Energy of the Prony terms.
    Viscous,
    /// Plastic work.
    Plastic,
}

impl TryFrom<Vec<EnergyKind>> for EnergySet {
    type Error = &'static str;

    fn try_from(kinds: Vec<EnergyKind>) -> Result<Self, Self::Error> {
        if !kinds.contains(&EnergyKind::Elastic) {
            return Err("the list must contain \"elastic\"");
        }
        let has = |kind| kinds.contains(&kind);
        Ok(Self { viscous: has(EnergyKind::Viscous), plastic: has(EnergyKind::Plastic) })
    }
}

impl From<EnergySet> for Vec<EnergyKind> {
    fn from(set: EnergySet) -> Self {
        let optional = [(set.viscous, EnergyKind::Viscous), (set.plastic, EnergyKind::Plastic)];
        let others = optional.into_iter().filter(|(present, _)| *present).map(|(_, kind)| kind);
        std::iter::once(EnergyKind::Elastic).chain(others).collect()
    }
}

/// Energies that drive damage and energies that damage degrades, at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DamageEnergies {
    /// Energies that drive damage.
    pub drive: EnergySet,
    /// Energies that damage degrades.
    pub degrade: EnergySet,
    /// Plastic work per reference volume above which the plastic work drives damage, MPa.
    pub plastic_threshold_mpa: f64,
}

impl Default for DamageEnergies {
    fn default() -> Self {
        let degrade = default_degrade();
        Self { drive: EnergySet::default(), degrade, plastic_threshold_mpa: 0.0 }
    }
}

/// Returns the default set of the energies that damage degrades: elastic and viscous.
fn default_degrade() -> EnergySet {
    EnergySet { viscous: true, plastic: false }
}

/// The phase-field damage model.
///
/// # Example
/// ```
/// use fem::{CrackDensity, Irreversibility, PhaseField};
///
/// let field = PhaseField {
///     model: CrackDensity::At1,
///     irreversibility: Irreversibility::ActiveSet,
///     ..PhaseField::new(0.06)
/// };
/// assert!(!field.hybrid);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PhaseField {
    /// Local part of the crack density.
    #[serde(default)]
    pub model: CrackDensity,
    /// Part of the elastic energy that damage degrades.
    #[serde(default)]
    pub split: Split,
    /// Whether the split applies only to the driving energy of damage, while damage degrades the whole energy. The
    /// stress is then linear in the strain at fixed damage. However, the faces of a crack can penetrate each other.
    /// Moreover, no energy is minimised: the solver alternates between displacement and damage, and the energy balance
    /// of the curve points has little meaning.
    ///
    /// Reference: Ambati, Gerasimov & De Lorenzis, Comput. Mech. 55 (2015) 383, doi:10.1007/s00466-014-1109-y.
    #[serde(default)]
    pub hybrid: bool,
    /// Condition that prevents cracks from healing.
    #[serde(default)]
    pub irreversibility: Irreversibility,
    /// Regularisation length ℓ₀, mm.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub length_mm: f64,
    /// Quadrature rule of the damage terms.
    #[serde(default)]
    pub quadrature: DamageQuadrature,
    /// Energies that drive damage.
    #[serde(default)]
    pub drive: EnergySet,
    /// Energies that damage degrades. If the set contains the plastic energy, damage also degrades
    /// the yield stress.
    #[serde(default = "default_degrade")]
    pub degrade: EnergySet,
    /// Plastic work per reference volume above which the plastic work drives damage, MPa.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub plastic_threshold_mpa: f64,
}

impl PhaseField {
    /// Creates the simplest model: AT2 without a split and without irreversibility.
    pub fn new(length_mm: f64) -> Self {
        Self {
            model: CrackDensity::At2,
            split: Split::None,
            hybrid: false,
            irreversibility: Irreversibility::None,
            length_mm,
            quadrature: DamageQuadrature::Auto,
            drive: EnergySet::default(),
            degrade: default_degrade(),
            plastic_threshold_mpa: 0.0,
        }
    }

    /// Returns the energies that drive damage and the energies that damage degrades.
    pub fn energies(&self) -> DamageEnergies {
        let Self { drive, degrade, plastic_threshold_mpa, .. } = *self;
        DamageEnergies { drive, degrade, plastic_threshold_mpa }
    }

    /// Returns whether displacement and damage make a common energy stationary.
    pub fn is_variational(&self) -> bool {
        self.irreversibility != Irreversibility::History
            && (!self.hybrid || self.split == Split::None)
    }

    /// Checks that the length is positive and finite, and that the plastic threshold is finite and not negative.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`].
    pub fn validate(&self) -> Result<(), FemError> {
        let threshold = self.plastic_threshold_mpa;
        if !(threshold >= 0.0 && threshold.is_finite()) {
            let (field, requirement) =
                ("plastic_threshold_mpa", "zero or a positive energy in MPa");
            return Err(FemError::parameter("phase_field", field, threshold, requirement));
        }
        if self.length_mm > 0.0 && self.length_mm.is_finite() {
            return Ok(());
        }
        Err(FemError::parameter(
            "phase_field",
            "length_mm",
            self.length_mm,
            "a positive length, such as the mean edge of the mesh",
        ))
    }
}
