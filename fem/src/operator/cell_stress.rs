//! Mean stress and energy density of each element, for output files.

use super::kernel::STRESS_SUMS;

/// Mean stress and energy density of an element.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CellStress {
    /// Elastic energy per reference volume, N mm/mm³ = MPa.
    pub energy_density_mpa: f64,
    /// Mean Cauchy stress over the current volume, MPa: xx, yy, zz, xy, yz, xz.
    pub stress_mpa: [f64; 6],
}

impl CellStress {
    /// Computes the means from the integrals of [`stress_sums`](super::kernel::stress_sums).
    pub(super) fn new([energy, volume, deformed, stress @ ..]: [f64; STRESS_SUMS]) -> Self {
        Self {
            energy_density_mpa: energy / volume,
            stress_mpa: stress.map(|entry| entry / deformed),
        }
    }

    /// Returns the von Mises stress: √(3/2) times the norm of the deviatoric stress, MPa.
    pub fn von_mises_mpa(&self) -> f64 {
        let [xx, yy, zz, xy, yz, xz] = self.stress_mpa;
        let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
        let shear = xy * xy + yz * yz + xz * xz;
        (0.5 * normal + 3.0 * shear).sqrt()
    }
}
