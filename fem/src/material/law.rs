//! The elastic laws, as functions of the principal logarithmic strains.

use super::{Split, UserLaw, hencky, neo_hookean};

/// The elastic law of a region with its moduli at small strain.
///
/// All are functions of the principal logarithmic strains ε_i (tr ε = ln J):
/// - Hencky: ψ = K/2 (tr ε)² + μ dev ε : dev ε;
/// - neo-Hookean: ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)²;
/// - a [`HyperelasticLaw`](super::HyperelasticLaw) of the user's own, which knows its moduli.
///
/// ψ is an energy per reference volume, MPa = N mm/mm³. References: Hencky, Z. Techn. Phys. 9
/// (1928) 215; Simo & Pister, Comput. Methods Appl. Mech. Engrg. 46 (1984) 201,
/// doi:10.1016/0045-7825(84)90062-8.
#[derive(Clone, Debug, PartialEq)]
pub enum Elasticity {
    /// Quadratic in the logarithmic strain; linear between Kirchhoff stress and Hencky strain.
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
    /// A law given by its energy; [`Material::hyperelastic`](super::Material::hyperelastic) makes it.
    User(UserLaw),
}

impl Elasticity {
    /// Young's modulus at small strain, MPa.
    pub fn young_mpa(&self) -> f64 {
        match self {
            Self::Hencky { young_mpa, .. } | Self::NeoHookean { young_mpa, .. } => *young_mpa,
            Self::User(law) => law.young_mpa(),
        }
    }

    /// Poisson's ratio at small strain.
    pub fn poisson(&self) -> f64 {
        match self {
            Self::Hencky { poisson, .. } | Self::NeoHookean { poisson, .. } => *poisson,
            Self::User(law) => law.poisson(),
        }
    }
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

impl Part {
    /// Adds `share` of another part.
    fn add(&mut self, share: f64, other: &Part) {
        self.energy += share * other.energy;
        for i in 0..3 {
            self.stress[i] += share * other.stress[i];
            self.shear[i] += share * other.shear[i];
            for j in 0..3 {
                self.tangent[i][j] += share * other.tangent[i][j];
            }
        }
    }
}

impl Parts {
    /// Both parts together, degraded as one.
    pub(crate) fn merged(self) -> Self {
        let mut plus = self.plus;
        plus.add(1.0, &self.minus);
        Self { plus, minus: Part::default() }
    }
}

impl Elasticity {
    /// Energy, stress and tangent in one pass.
    pub(crate) fn respond(&self, split: Split, m: &Moduli, strain: [f64; 3]) -> Parts {
        match self {
            Elasticity::Hencky { .. } => hencky::respond(split, m, strain),
            Elasticity::NeoHookean { .. } => parts(split, strain, |e| neo_hookean::respond(m, e)),
            Elasticity::User(law) => parts(split, strain, |e| law.respond(e)),
        }
    }
}

/// The parts of a law of which the whole is given.
///
/// Volumetric–deviatoric: the energy U(J) of the pure change of volume is spared where J < 1. As all
/// its principal stresses are U′(ln J), their differences vanish.
fn parts(split: Split, strain: [f64; 3], whole: impl Fn([f64; 3]) -> Part) -> Parts {
    let (mut plus, mut minus) = (whole(strain), Part::default());
    let trace = strain[0] + strain[1] + strain[2];
    if split == Split::VolumetricDeviatoric && trace < 0.0 {
        let dilated = whole([trace / 3.0; 3]);
        let curvature = dilated.tangent.as_flattened().iter().sum::<f64>() / 9.0;
        minus = Part { tangent: [[curvature; 3]; 3], shear: [0.0; 3], ..dilated };
        plus.add(-1.0, &minus);
    }
    Parts { plus, minus }
}
