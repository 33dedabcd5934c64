//! Response of a law at a point, in the basis of the principal strains.

use super::number::Scalar;

/// Energies, stress and tangent for a given degradation g.
#[derive(Clone, Copy, Debug)]
pub struct Response<T> {
    /// Elastic energy g ψ⁺ + ψ⁻, MPa.
    pub energy: T,
    /// Driving energy of damage: derivative of the energy with respect to g, ψ⁺.
    pub driving: T,
    /// Second derivative of the energy with respect to g; zero except for mixtures.
    pub softening: T,
    /// Principal values τ_i of g τ⁺ + τ⁻.
    pub stress: [T; 3],
    /// Principal values τ⁺_i.
    pub stress_plus: [T; 3],
    /// D_ij = ∂τ_i/∂ε_j, with indices by [`packed`].
    pub normal: [T; 6],
    /// ½ (τ_i − τ_j) coth(ε_i − ε_j); the index is that of the third strain.
    pub shear: [T; 3],
}

/// Returns the index of entry (r, s ≤ r) of a symmetric matrix in packed storage.
#[inline(always)]
pub const fn packed(r: usize, s: usize) -> usize {
    r * (r + 1) / 2 + s
}

/// Undamaged response of a law, from which a split separates the volumetric part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole<T> {
    pub(super) energy: T,
    pub(super) stress: [T; 3],
    pub(super) normal: [T; 6],
    pub(super) shear: [T; 3],
}

impl<T: Scalar> Whole<T> {
    /// Returns the response with the split of `spared`: U(t) and its first two derivatives with respect to t = tr ε.
    /// If t < 0, this part is not degraded.
    ///
    /// U is the energy of a pure change of volume. All its principal stresses are U′, so that their differences
    /// vanish. With `hybrid`, the split applies to the driving energy only.
    #[inline(always)]
    pub(super) fn split(self, mut spared: [T; 3], trace: T, hybrid: bool, g: T) -> Response<T> {
        let zero = g.constant(0.0);
        for k in 0..3 {
            spared[k] = T::select(trace.less_than(zero), spared[k], zero);
        }
        let driving = self.energy - spared[0];
        if hybrid {
            spared = [zero; 3];
        }
        let [energy, stress, curvature] = spared;
        let mut out = Response {
            energy: g.mul_add(self.energy - energy, energy),
            driving,
            softening: zero,
            stress: self.stress,
            stress_plus: self.stress,
            normal: self.normal,
            shear: self.shear,
        };
        for i in 0..3 {
            out.stress_plus[i] = self.stress[i] - stress;
            out.stress[i] = g.mul_add(out.stress_plus[i], stress);
            out.shear[i] = g * self.shear[i];
        }
        for entry in 0..6 {
            out.normal[entry] = g.mul_add(self.normal[entry] - curvature, curvature);
        }
        out
    }
}

impl Response<f64> {
    /// Number of values in a response.
    pub(super) const NUMBERS: usize = 18;

    pub(super) fn numbers(&self) -> [f64; Self::NUMBERS] {
        let mut all = [0.0; Self::NUMBERS];
        all[0] = self.energy;
        all[1] = self.driving;
        all[2..5].copy_from_slice(&self.stress);
        all[5..8].copy_from_slice(&self.stress_plus);
        all[8..14].copy_from_slice(&self.normal);
        all[14..17].copy_from_slice(&self.shear);
        all[17] = self.softening;
        all
    }
}

impl<T: Copy> Response<T> {
    /// Creates the response from the values that [`numbers`](Response::numbers) returns.
    #[inline(always)]
    pub(super) fn from_numbers(all: &[T; Response::<f64>::NUMBERS]) -> Self {
        Self {
            energy: all[0],
            driving: all[1],
            stress: [all[2], all[3], all[4]],
            stress_plus: [all[5], all[6], all[7]],
            normal: [all[8], all[9], all[10], all[11], all[12], all[13]],
            shear: [all[14], all[15], all[16]],
            softening: all[17],
        }
    }
}
