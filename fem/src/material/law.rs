//! The elastic laws, as functions of the principal logarithmic strains.

use super::{Split, UserLaw, hencky, neo_hookean};

/// An isotropic hyperelastic law.
///
/// All are functions of the principal logarithmic strains ε_i (tr ε = ln J):
/// - Hencky: ψ = K/2 (tr ε)² + μ dev ε : dev ε;
/// - neo-Hookean: ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)²;
/// - a [`HyperelasticLaw`](super::HyperelasticLaw) of the user's own.
///
/// ψ is an energy per reference volume, MPa = N mm/mm³. References: Hencky, Z. Techn. Phys. 9
/// (1928) 215; Simo & Pister, Comput. Methods Appl. Mech. Engrg. 46 (1984) 201,
/// doi:10.1016/0045-7825(84)90062-8.
#[derive(Clone, Debug, PartialEq)]
pub enum ElasticLaw {
    /// Quadratic in the logarithmic strain; linear between Kirchhoff stress and Hencky strain.
    Hencky,
    /// Compressible neo-Hookean solid.
    NeoHookean,
    /// A law given by its energy; [`Material::hyperelastic`](super::Material::hyperelastic) makes it.
    User(UserLaw),
}

/// Elastic constants in the forms that the laws use, MPa.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moduli {
    pub(crate) bulk: f64,
    pub(crate) shear: f64,
    pub(crate) lame: f64,
}

impl Moduli {
    pub(crate) fn new(young: f64, poisson: f64) -> Self {
        let bulk = young / (3.0 * (1.0 - 2.0 * poisson));
        let shear = young / (2.0 * (1.0 + poisson));
        Self { bulk, shear, lame: bulk - 2.0 / 3.0 * shear }
    }

    /// Young's modulus.
    pub(crate) fn young(&self) -> f64 {
        9.0 * self.bulk * self.shear / (3.0 * self.bulk + self.shear)
    }
}

/// One part of a law (degraded or not) at a point, in the principal basis.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Part {
    /// ψ.
    pub(crate) energy: f64,
    /// τ_i = ∂ψ/∂ε_i, the Kirchhoff stress.
    pub(crate) stress: [f64; 3],
    /// D_ij = ∂τ_i/∂ε_j.
    pub(crate) tangent: [[f64; 3]; 3],
    /// ½ (τ_i − τ_j) coth(ε_i − ε_j), stored at the third index 3 − i − j.
    pub(crate) shear: [f64; 3],
}

/// The degraded and the undegraded part.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Parts {
    pub(crate) plus: Part,
    pub(crate) minus: Part,
}

impl Parts {
    /// Both parts together, degraded as one.
    pub(crate) fn merged(self) -> Self {
        let mut plus = self.plus;
        plus.energy += self.minus.energy;
        for i in 0..3 {
            plus.stress[i] += self.minus.stress[i];
            plus.shear[i] += self.minus.shear[i];
            for j in 0..3 {
                plus.tangent[i][j] += self.minus.tangent[i][j];
            }
        }
        Self { plus, minus: Part::default() }
    }
}

impl ElasticLaw {
    /// Energy, stress and tangent in one pass.
    pub(crate) fn respond(&self, split: Split, m: &Moduli, strain: [f64; 3]) -> Parts {
        match self {
            ElasticLaw::Hencky => hencky::respond(split, m, strain),
            ElasticLaw::NeoHookean => {
                Parts { plus: neo_hookean::respond(m, strain), minus: Part::default() }
            }
            ElasticLaw::User(law) => Parts { plus: law.respond(strain), minus: Part::default() },
        }
    }
}
