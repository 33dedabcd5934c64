//! Strain measures for the energy of a law.

use num_dual::DualNum;

/// The principal logarithmic strains ε_i = ln λ_i of a deformation, over any scalar.
///
/// Isotropic energies are functions of these strains. Every measure below follows from the three strains, and is
/// computed so that small strains keep their digits (λ^α − 1, never λ^α alone).
#[derive(Clone, Copy, Debug)]
pub struct PrincipalStrain<T> {
    log: [T; 3],
}

impl<T: DualNum<f64> + Copy> PrincipalStrain<T> {
    /// Creates the state with the given logarithmic strains.
    pub fn new(log: [T; 3]) -> Self {
        Self { log }
    }

    /// Returns ε_i = ln λ_i.
    pub fn log(&self) -> [T; 3] {
        self.log
    }

    /// Returns ln J = Σ ε_i, with J = det F.
    pub fn log_volume(&self) -> T {
        self.log[0] + self.log[1] + self.log[2]
    }

    /// Returns ln λ̄_i = ε_i − ⅓ ln J: the strains of the isochoric part of F.
    pub fn isochoric_log(&self) -> [T; 3] {
        let third = self.log_volume() / 3.0;
        self.log.map(|e| e - third)
    }

    /// Returns Green's strains E_i = ½ (λ_i² − 1).
    pub fn green(&self) -> [T; 3] {
        self.log.map(|e| (e * 2.0).exp_m1() * 0.5)
    }

    /// Returns Σ (λ_i^α − 1); α = 2 gives I₁ − 3.
    pub fn power_sum(&self, alpha: f64) -> T {
        sum(self.log.map(|e| (e * alpha).exp_m1()))
    }

    /// Returns Σ (λ̄_i^α − 1); α = 2 gives Ī₁ − 3 and α = −2 gives Ī₂ − 3.
    pub fn isochoric_power_sum(&self, alpha: f64) -> T {
        sum(self.isochoric_log().map(|e| (e * alpha).exp_m1()))
    }

    /// Returns the volumetric energy K/4 (J² − 1 − 2 ln J) for bulk modulus K. It is convex in J, and infinite for J
    /// → 0 and for J → ∞.
    ///
    /// Reference: Simo & Taylor, Comput. Methods Appl. Mech. Engrg. 85 (1991) 273,
    /// doi:10.1016/0045-7825(91)90100-K.
    pub fn volumetric_energy(&self, bulk: f64) -> T {
        let twice = self.log_volume() * 2.0;
        (twice.exp_m1() - twice) * (bulk / 4.0)
    }
}

fn sum<T: DualNum<f64> + Copy>(x: [T; 3]) -> T {
    x[0] + x[1] + x[2]
}
