//! Strain measures with which the energy of a law is written.

use super::number::Scalar;

/// Principal logarithmic strains ε_i = ln λ_i of a deformation, for any number type.
///
/// Isotropic energies are functions of these strains. Every strain measure of this type is computed so that small
/// strains keep their digits (λ^α − 1, never λ^α alone).
#[derive(Clone, Copy, Debug)]
pub struct PrincipalStrain<T> {
    log: [T; 3],
    /// Excess λ_i² − 1 of the squared stretches.
    excess: [T; 3],
}

impl<T: Scalar> PrincipalStrain<T> {
    /// Creates the strains from their logarithmic values.
    #[inline(always)]
    pub fn new(log: [T; 3]) -> Self {
        let mut excess = log;
        for i in 0..3 {
            excess[i] = (log[i] * 2.0).exp_m1();
        }
        Self { log, excess }
    }

    /// Creates the strains from their logarithmic values and `excess` = λ_i² − 1.
    #[inline(always)]
    pub(super) fn with_excess(log: [T; 3], excess: [T; 3]) -> Self {
        Self { log, excess }
    }

    /// Returns ε_i = ln λ_i.
    #[inline(always)]
    pub fn log(&self) -> [T; 3] {
        self.log
    }

    /// Returns ln J = Σ ε_i, with J = det F.
    #[inline(always)]
    pub fn log_volume(&self) -> T {
        sum(self.log)
    }

    /// Returns ln λ̄_i = ε_i − ⅓ ln J: the strains of the isochoric part of F.
    #[inline(always)]
    pub fn isochoric_log(&self) -> [T; 3] {
        let third = self.log_volume() / 3.0;
        let mut out = self.log;
        for i in 0..3 {
            out[i] = out[i] - third;
        }
        out
    }

    /// Returns Green's strains E_i = ½ (λ_i² − 1).
    #[inline(always)]
    pub fn green(&self) -> [T; 3] {
        let mut out = self.excess;
        for i in 0..3 {
            out[i] = out[i] * 0.5;
        }
        out
    }

    /// Returns Σ (λ_i^α − 1); α = 2 gives I₁ − 3.
    #[inline(always)]
    pub fn power_sum(&self, alpha: f64) -> T {
        if alpha == 2.0 { sum(self.excess) } else { power_sum(self.log, alpha) }
    }

    /// Returns Σ (λ̄_i^α − 1); α = 2 gives Ī₁ − 3 and α = −2 gives Ī₂ − 3.
    #[inline(always)]
    pub fn isochoric_power_sum(&self, alpha: f64) -> T {
        power_sum(self.isochoric_log(), alpha)
    }

    /// Returns the volumetric energy K/4 (J² − 1 − 2 ln J) for bulk modulus K. It is convex in J, and infinite for J
    /// → 0 and for J → ∞.
    ///
    /// Reference: Simo & Taylor, Comput. Methods Appl. Mech. Engrg. 85 (1991) 273,
    /// doi:10.1016/0045-7825(91)90100-K.
    #[inline(always)]
    pub fn volumetric_energy(&self, bulk: f64) -> T {
        let twice = self.log_volume() * 2.0;
        (twice.exp_m1() - twice) * (bulk / 4.0)
    }
}

/// Returns Σ (λ_i^α − 1) for λ_i = e^`log[i]`.
#[inline(always)]
fn power_sum<T: Scalar>(log: [T; 3], alpha: f64) -> T {
    let mut powers = log;
    for i in 0..3 {
        powers[i] = (log[i] * alpha).exp_m1();
    }
    sum(powers)
}

#[inline(always)]
fn sum<T: Scalar>(x: [T; 3]) -> T {
    x[0] + x[1] + x[2]
}
