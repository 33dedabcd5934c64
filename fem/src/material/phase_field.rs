//! The choices of the damage model that all regions share.

use super::CrackDensity;
use crate::error::FemError;

/// Which part of the elastic energy damage degrades, and drives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Split {
    /// All of it: damage grows in tension and in compression alike.
    None,
    /// ψ⁺ = K/2 ⟨tr ε⟩₊² + μ dev ε : dev ε; a crack still carries pressure.
    ///
    /// Reference: Amor, Marigo & Maurini, J. Mech. Phys. Solids 57 (2009) 1209,
    /// doi:10.1016/j.jmps.2009.04.011.
    VolumetricDeviatoric,
}

/// Where the damage terms are integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DamageQuadrature {
    /// `Vertex` with ℓ₀ below twice the mean distance of nodes on an edge (linear elements: the
    /// edge, quadratic ones: half of it), `Consistent` otherwise.
    Auto,
    /// At the nodes (quadratic elements: at the vertices of their eight sub-tetrahedra). Keeps
    /// 0 ≤ φ < 1 where ℓ₀ is below the element size; an element then sees the mean of g.
    Vertex,
    /// Gauss points that integrate the damage terms of a linear element exactly.
    Consistent,
}

/// The phase-field damage model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhaseField {
    /// Local part of the crack density.
    pub model: CrackDensity,
    /// What damage degrades.
    pub split: Split,
    /// Regularisation length ℓ₀, mm.
    pub length_mm: f64,
    /// Where the damage terms are integrated.
    pub quadrature: DamageQuadrature,
}

impl PhaseField {
    pub(crate) fn validate(&self) -> Result<(), FemError> {
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
