//! Elastic laws as functions of the principal logarithmic strains.

mod constitutive;
mod elastic_law;
pub(in crate::material) mod hencky;
mod hyperelastic;
mod mooney_rivlin;
pub(in crate::material) mod neo_hookean;
mod ogden;
mod saint_venant_kirchhoff;

pub(in crate::material) use constitutive::MOST_STATE;
pub use constitutive::{ConstitutiveLaw, UserConstitutiveLaw};
pub use elastic_law::ElasticLaw;
pub use hyperelastic::{HyperelasticLaw, UserLaw};
pub use mooney_rivlin::MooneyRivlin;
pub use ogden::{Ogden, OgdenTerm};
pub use saint_venant_kirchhoff::SaintVenantKirchhoff;

use crate::error::FemError;

/// Elastic law of a region, with its moduli at small strain.
///
/// All laws are functions of the principal logarithmic strains ε_i (tr ε = ln J):
/// - Hencky: ψ = K/2 (tr ε)² + μ dev ε : dev ε;
/// - neo-Hookean: ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)²;
/// - a user-defined [`HyperelasticLaw`](crate::HyperelasticLaw), whose moduli follow from its energy;
/// - a user-defined [`ConstitutiveLaw`](crate::ConstitutiveLaw), which may have a state.
///
/// ψ is an energy per reference volume, MPa = N mm/mm³. References: Hencky, Z. Techn. Phys. 9
/// (1928) 215; Simo & Pister, Comput. Methods Appl. Mech. Engrg. 46 (1984) 201,
/// doi:10.1016/0045-7825(84)90062-8.
#[derive(Clone, Debug, PartialEq)]
pub enum Elasticity {
    /// Quadratic in the logarithmic strain, so that the Kirchhoff stress is linear in the Hencky strain.
    Hencky {
        /// Young's modulus, MPa.
        young_mpa: f64,
        /// Poisson's ratio, in (−1, ½).
        poisson: f64,
    },
    /// Compressible neo-Hookean solid.
    NeoHookean {
        /// Young's modulus, MPa.
        young_mpa: f64,
        /// Poisson's ratio, in (−1, ½).
        poisson: f64,
    },
    /// User-defined law, given by its energy; created by [`Material::hyperelastic`](crate::Material::hyperelastic).
    User(UserLaw),
    /// User-defined law that may have a state; created by [`Material::with_law`](super::Material::with_law).
    Constitutive(UserConstitutiveLaw),
}

impl Elasticity {
    /// Returns Young's modulus at small strain, MPa.
    pub fn young_mpa(&self) -> f64 {
        match self {
            Self::Hencky { young_mpa, .. } | Self::NeoHookean { young_mpa, .. } => *young_mpa,
            Self::User(law) => law.young_mpa(),
            Self::Constitutive(law) => law.young_and_poisson()[0],
        }
    }

    /// Returns Poisson's ratio at small strain.
    pub fn poisson(&self) -> f64 {
        match self {
            Self::Hencky { poisson, .. } | Self::NeoHookean { poisson, .. } => *poisson,
            Self::User(law) => law.poisson(),
            Self::Constitutive(law) => law.young_and_poisson()[1],
        }
    }
}

/// Checks Young's modulus (MPa) and Poisson's ratio; rejects values that are invalid or probably have another unit.
pub(in crate::material) fn check_moduli(
    entity: &str,
    young: f64,
    poisson: f64,
) -> Result<(), FemError> {
    let refuse =
        |field, value, requirement| Err(FemError::parameter(entity, field, value, requirement));
    if !(1e-3..=1e7).contains(&young) {
        return refuse("young_mpa", young, "a positive modulus in MPa, from 1e-3 to 1e7");
    }
    if !(poisson > -1.0 && poisson < 0.5) {
        let requirement = "between -1 and 0.5, both excluded (0.5 is incompressible: use 0.49)";
        return refuse("poisson", poisson, requirement);
    }
    Ok(())
}

/// Bulk and shear modulus, MPa.
#[derive(Clone, Copy, Debug)]
pub struct Moduli {
    pub bulk: f64,
    pub shear: f64,
}

impl Moduli {
    /// Computes bulk and shear modulus from Young's modulus (MPa) and Poisson's ratio.
    pub fn new(young: f64, poisson: f64) -> Self {
        Self { bulk: young / (3.0 * (1.0 - 2.0 * poisson)), shear: young / (2.0 * (1.0 + poisson)) }
    }

    /// Returns λ + 2μ = K + 4μ/3, MPa: the modulus for strain along one axis, and the largest entry of the tangent.
    pub fn longitudinal(&self) -> f64 {
        self.bulk + 4.0 / 3.0 * self.shear
    }

    /// Returns Young's modulus, MPa.
    pub fn young(&self) -> f64 {
        9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)
    }
}
