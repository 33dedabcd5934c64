//! Mean stress and energy density of each element, for output files.

use super::element::{ElementState, MOST_POINTS};
use crate::material::{PointLaw, Scalar};

/// Number of entries of [`ElementState::stress_sums`].
pub(super) const SUMS: usize = 9;
/// Tensor indices of xx, yy, zz, xy, yz, xz: the order of VTK.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Mean stress and energy density of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellStress {
    /// Elastic energy per reference volume, N mm/mm³ = MPa.
    pub energy_density_mpa: f64,
    /// Mean Cauchy stress over the current volume, MPa: xx, yy, zz, xy, yz, xz.
    pub stress_mpa: [f64; 6],
}

impl CellStress {
    pub fn of([energy, volume, deformed, stress @ ..]: [f64; SUMS]) -> Self {
        Self {
            energy_density_mpa: energy / volume,
            stress_mpa: stress.map(|entry| entry / deformed),
        }
    }

    /// Von Mises stress: √(3/2) times the norm of the deviatoric stress, MPa.
    pub fn von_mises_mpa(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.stress_mpa;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        let shear = xy * xy + yz * yz + xz * xz;
        (0.5 * normal + 3.0 * shear).sqrt()
    }
}

impl<T: Scalar, L: PointLaw<T>, const N: usize> ElementState<'_, T, L, N> {
    /// ∫ψ dV, ∫dV, ∫J dV and the entries of ∫τ dV, with τ = J σ. The second value is 1, or 0 if the element
    /// is inverted.
    #[inline(always)]
    pub fn stress_sums(&self) -> ([T; SUMS], T) {
        let zero = self.constants.local.constant(0.0);
        let one = zero.constant(1.0);
        let (mut sums, mut sound) = ([zero; SUMS], one);
        let phi: [T; MOST_POINTS] = self.damage_at_points();
        for q in 0..self.rule.points.len() {
            let at = self.at::<false>(q, &phi);
            sound = sound.min(at.principal.sound);
            let [a, b, c] = at.principal.strains.excess;
            let change = ((one + a) * (one + b) * (one + c)).sqrt();
            sums[0] = at.weight.mul_add(at.response.energy, sums[0]);
            sums[1] += at.weight;
            sums[2] = at.weight.mul_add(change, sums[2]);
            for (entry, (i, j)) in ENTRIES.into_iter().enumerate() {
                let (n, m) = (&at.principal.basis[i], &at.principal.basis[j]);
                for k in 0..3 {
                    let part = at.response.stress[k] * n[k] * m[k];
                    sums[3 + entry] = at.weight.mul_add(part, sums[3 + entry]);
                }
            }
        }
        (sums, sound)
    }
}
