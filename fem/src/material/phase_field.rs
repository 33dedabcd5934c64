//! The choices of the damage model that all regions share.

use serde::{Deserialize, Serialize};

use super::crack_density::CrackDensity;
use crate::error::FemError;

/// Which part of the elastic energy damage degrades, and drives it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// All of it: damage grows in tension and in compression alike.
    #[default]
    None,
    /// ψ⁺ = K/2 ⟨tr ε⟩₊² + μ dev ε : dev ε; a crack still carries pressure.
    ///
    /// For laws other than Hencky's ψ⁻ = U(J) where J < 1, the energy of the pure change of volume
    /// F = J^(1/3) I: the volumetric term itself where ψ has one, as Mooney–Rivlin and Ogden do, and
    /// 3μ/2 (J^(2/3) − 1 − ⅔ ln J) + λ/2 (ln J)² for the neo-Hookean solid.
    ///
    /// Reference: Amor, Marigo & Maurini, J. Mech. Phys. Solids 57 (2009) 1209,
    /// doi:10.1016/j.jmps.2009.04.011.
    VolumetricDeviatoric,
    /// ψ⁺ = λ/2 ⟨tr ε⟩₊² + μ Σ ⟨ε_i⟩₊²: only what is stretched breaks.
    ///
    /// Reference: Miehe, Hofacker & Welschinger, Comput. Methods Appl. Mech. Engrg. 199 (2010)
    /// 2765, doi:10.1016/j.cma.2010.04.011, here in logarithmic strains. For Hencky's law only.
    Spectral,
}

/// What keeps a crack from healing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Irreversibility {
    /// Nothing: damage follows its driving energy down again.
    #[default]
    None,
    /// The largest ψ⁺ that a point has seen drives its damage. Damage then has no energy of which
    /// it is the minimiser, and the two fields are solved for in turn.
    ///
    /// Reference: Miehe, Hofacker & Welschinger (2010), as for [`Split::Spectral`].
    History,
    /// φ ≥ φ_n at every node, by an active set.
    ///
    /// Reference: Heister, Wheeler & Wick, Comput. Methods Appl. Mech. Engrg. 290 (2015) 466,
    /// doi:10.1016/j.cma.2015.03.009.
    ActiveSet,
}

/// Where the damage terms are integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DamageQuadrature {
    /// `Vertex` with ℓ₀ below twice the mean distance of nodes on an edge (linear elements: the
    /// edge, quadratic ones: half of it) and for AT1 in quadratic elements, whose vertices Gauss points
    /// would damage unloaded; `Consistent` otherwise.
    #[default]
    Auto,
    /// At the nodes (quadratic elements: at the vertices of their eight sub-tetrahedra). Keeps φ < 1 where
    /// ℓ₀ is below the element size; an element then sees the mean of g. φ may fall a little below 0 beside
    /// damaged nodes, where the gradient term couples the ends of an edge with the wrong sign (dihedral angles above
    /// 90°; −0.07 at worst on meshes tried). [`Irreversibility::ActiveSet`] keeps φ ≥ 0, and so does AT1.
    Vertex,
    /// Gauss points of positive weight, which integrate φ² exactly: four in linear elements, fourteen
    /// in quadratic ones.
    Consistent,
    /// The same with eleven points in quadratic elements, the least for φ². One of them has a negative
    /// weight, so that energy could be gained there: for smooth fields on fine meshes.
    Eleven,
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseField {
    /// Local part of the crack density.
    #[serde(default)]
    pub model: CrackDensity,
    /// What damage degrades.
    #[serde(default)]
    pub split: Split,
    /// The split decides what drives damage only, while damage degrades all of the energy. The
    /// stress is then linear in the strain at fixed damage, but crack faces no longer meet, and no
    /// energy is minimised: the two fields are solved for in turn, and the balance of energy that
    /// comes with each point means little.
    ///
    /// Reference: Ambati, Gerasimov & De Lorenzis, Comput. Mech. 55 (2015) 383,
    /// doi:10.1007/s00466-014-1109-y.
    #[serde(default)]
    pub hybrid: bool,
    /// What keeps a crack from healing.
    #[serde(default)]
    pub irreversibility: Irreversibility,
    /// Regularisation length ℓ₀, mm.
    pub length_mm: f64,
    /// Where the damage terms are integrated.
    #[serde(default)]
    pub quadrature: DamageQuadrature,
}

impl PhaseField {
    /// AT2 with all of the energy degraded and nothing against healing: the preset of the paper.
    pub fn new(length_mm: f64) -> Self {
        Self {
            model: CrackDensity::At2,
            split: Split::None,
            hybrid: false,
            irreversibility: Irreversibility::None,
            length_mm,
            quadrature: DamageQuadrature::Auto,
        }
    }

    /// Whether displacement and damage make one energy stationary.
    pub fn is_variational(&self) -> bool {
        self.irreversibility != Irreversibility::History
            && (!self.hybrid || self.split == Split::None)
    }

    /// Refuses a length that is none.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub fn validate(&self) -> Result<(), FemError> {
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
