//! Response of a law at a point, in the basis of the principal strains.

use super::number::Scalar;

/// Energies, stress and tangent of a point for a given degradation g, in the basis of the principal strains.
#[derive(Clone, Copy, Debug)]
pub struct Response<T> {
    /// Elastic energy g ψ⁺ + ψ⁻, MPa.
    pub energy: T,
    /// Driving energy of damage, MPa: ψ⁺, the derivative of the energy with respect to g. The settings of the phase
    /// field may select other energies of viscoelastic and plastic laws.
    pub driving: T,
    /// Second derivative of the energy with respect to g, MPa; zero except for mixtures.
    pub driving_slope: T,
    /// Principal values τ_i of the Kirchhoff stress g τ⁺ + τ⁻, MPa.
    pub stress: [T; 3],
    /// Principal values τ⁺_i of the degraded part of the stress, without the factor g, MPa.
    pub stress_plus: [T; 3],
    /// D_ij = ∂τ_i/∂ε_j in the order D_00, D_10, D_11, D_20, D_21, D_22, MPa.
    pub normal: [T; 6],
    /// ½ (τ_i − τ_j) coth(ε_i − ε_j), MPa; entry k belongs to the pair (i, j) of the other two strains.
    pub shear: [T; 3],
    /// Principal values of ∂ψ_d/∂ε with the driving energy ψ_d, MPa. They equal `stress_plus` if ψ_d is the derivative
    /// of an energy with respect to g. Plastic laws always set `stress_plus`, without the derivative of the plastic
    /// work.
    pub driving_stress: [T; 3],
    /// Energy that the law dissipates in the increment, MPa; zero for elastic laws.
    pub dissipation: T,
    /// Antisymmetric part of ∂τ_i/∂ε_j as a vector w, D_ij − D_ji = 2 (w_i − w_j), MPa; zero unless plastic flow is not
    /// associated.
    pub skew: [T; 3],
    /// Components of stresses outside the principal axes of the strain; zero except in viscoelastic laws.
    pub oblique: Oblique<T>,
}

/// Components outside the principal axes; entry k belongs to the pair (i, j) of the other two axes.
#[derive(Clone, Copy, Debug)]
pub struct Oblique<T> {
    /// Components of the stress τ, MPa. The stress has the form dev a with a tensor a that moves with the material, a =
    /// J^(−2/3) F A Fᵀ at constant A; the tangent follows from this form.
    pub stress: [T; 3],
    /// Components of ∂τ/∂g, MPa.
    pub stress_plus: [T; 3],
    /// Components of ∂ψ_d/∂ε with the driving energy ψ_d, MPa.
    pub driving_stress: [T; 3],
}

impl<T: Scalar> Oblique<T> {
    /// Returns components that are zero. `number` only selects the number type.
    #[inline(always)]
    pub fn zero(number: T) -> Self {
        let zero = [number.constant(0.0); 3];
        Self { stress: zero, stress_plus: zero, driving_stress: zero }
    }
}

/// Returns the index of entry (r, s ≤ r) of a symmetric matrix in packed storage.
#[inline(always)]
pub const fn packed(r: usize, s: usize) -> usize {
    r * (r + 1) / 2 + s
}

/// Response of a law (or of a part of its energy) without damage, in the basis of the principal
/// strains.
#[derive(Clone, Copy, Debug)]
pub struct ElasticResponse<T> {
    /// Energy per reference volume, MPa.
    pub energy: T,
    /// Principal Kirchhoff stresses τ_i, MPa.
    pub stress: [T; 3],
    /// D_ij = ∂τ_i/∂ε_j in the order D_00, D_10, D_11, D_20, D_21, D_22, MPa.
    pub normal: [T; 6],
    /// ½ (τ_i − τ_j) coth(ε_i − ε_j), MPa; entry k belongs to the pair (i, j) of the other two strains.
    pub shear: [T; 3],
}

impl<T: Scalar> ElasticResponse<T> {
    /// Returns the response of zero energy. `number` only selects the number type.
    #[inline(always)]
    pub fn zero(number: T) -> Self {
        let zero = number.constant(0.0);
        Self { energy: zero, stress: [zero; 3], normal: [zero; 6], shear: [zero; 3] }
    }

    /// Returns the response for an energy that depends only on the volume change t = tr ε. The arguments are
    /// this energy and its first two derivatives with respect to t. All principal stresses are equal.
    #[inline(always)]
    pub fn volumetric([energy, stress, curvature]: [T; 3]) -> Self {
        let zero = energy.constant(0.0);
        Self { energy, stress: [stress; 3], normal: [curvature; 6], shear: [zero; 3] }
    }

    /// Returns this response minus the response for an energy that depends only on the volume
    /// change, see [`volumetric`](Self::volumetric).
    #[inline(always)]
    pub(super) fn without_volume(mut self, [energy, stress, curvature]: [T; 3]) -> Self {
        self.energy = self.energy - energy;
        for i in 0..3 {
            self.stress[i] = self.stress[i] - stress;
        }
        for entry in 0..6 {
            self.normal[entry] = self.normal[entry] - curvature;
        }
        self
    }

    /// Returns the response multiplied by a factor.
    #[inline(always)]
    pub fn times(mut self, factor: T) -> Self {
        self.energy = factor * self.energy;
        for i in 0..3 {
            self.stress[i] = factor * self.stress[i];
            self.shear[i] = factor * self.shear[i];
        }
        for entry in 0..6 {
            self.normal[entry] = factor * self.normal[entry];
        }
        self
    }

    /// Returns this response in the SIMD lanes where the mask is true, zero in the other lanes.
    #[inline(always)]
    pub fn only(mut self, mask: T::Mask) -> Self {
        let zero = self.energy.constant(0.0);
        self.energy = T::select(mask, self.energy, zero);
        for i in 0..3 {
            self.stress[i] = T::select(mask, self.stress[i], zero);
            self.shear[i] = T::select(mask, self.shear[i], zero);
        }
        for entry in 0..6 {
            self.normal[entry] = T::select(mask, self.normal[entry], zero);
        }
        self
    }

    /// Returns the response if the whole energy is degraded and drives damage.
    #[inline(always)]
    pub fn degraded(self, g: T) -> Response<T> {
        let zero = Self::zero(g);
        self.degraded_without(zero, zero, g)
    }

    /// Returns the response if the part `spared` of this response is not degraded, and the part `passive` does not
    /// drive damage.
    #[inline(always)]
    pub(super) fn degraded_without(self, spared: Self, passive: Self, g: T) -> Response<T> {
        let mut out = Response {
            energy: g.mul_add(self.energy - spared.energy, spared.energy),
            driving: self.energy - passive.energy,
            driving_slope: g.constant(0.0),
            stress: self.stress,
            stress_plus: self.stress,
            normal: self.normal,
            shear: self.shear,
            driving_stress: self.stress,
            dissipation: g.constant(0.0),
            skew: [g.constant(0.0); 3],
            oblique: Oblique::zero(g),
        };
        for i in 0..3 {
            out.stress_plus[i] = self.stress[i] - spared.stress[i];
            out.stress[i] = g.mul_add(out.stress_plus[i], spared.stress[i]);
            out.shear[i] = g.mul_add(self.shear[i] - spared.shear[i], spared.shear[i]);
            out.driving_stress[i] = self.stress[i] - passive.stress[i];
        }
        for entry in 0..6 {
            out.normal[entry] =
                g.mul_add(self.normal[entry] - spared.normal[entry], spared.normal[entry]);
        }
        out
    }
}

impl<T: Scalar> Response<T> {
    /// Returns the response of zero energy. `number` only selects the number type.
    #[inline(always)]
    pub fn zero(number: T) -> Self {
        ElasticResponse::zero(number).degraded(number)
    }

    /// Returns energy, stress and tangent without the quantities of damage.
    #[inline(always)]
    pub(super) fn elastic(&self) -> ElasticResponse<T> {
        let Self { energy, stress, normal, shear, .. } = *self;
        ElasticResponse { energy, stress, normal, shear }
    }

    /// Returns `yes` in the SIMD lanes where the mask is true, `no` in the other lanes.
    #[inline(always)]
    pub(super) fn select(mask: T::Mask, yes: Self, mut no: Self) -> Self {
        no.energy = T::select(mask, yes.energy, no.energy);
        no.driving = T::select(mask, yes.driving, no.driving);
        no.driving_slope = T::select(mask, yes.driving_slope, no.driving_slope);
        for i in 0..3 {
            no.stress[i] = T::select(mask, yes.stress[i], no.stress[i]);
            no.stress_plus[i] = T::select(mask, yes.stress_plus[i], no.stress_plus[i]);
            no.shear[i] = T::select(mask, yes.shear[i], no.shear[i]);
            let driving = T::select(mask, yes.driving_stress[i], no.driving_stress[i]);
            no.driving_stress[i] = driving;
            no.skew[i] = T::select(mask, yes.skew[i], no.skew[i]);
            let (from, to) = (&yes.oblique, &mut no.oblique);
            to.stress[i] = T::select(mask, from.stress[i], to.stress[i]);
            to.stress_plus[i] = T::select(mask, from.stress_plus[i], to.stress_plus[i]);
            to.driving_stress[i] = T::select(mask, from.driving_stress[i], to.driving_stress[i]);
        }
        for entry in 0..6 {
            no.normal[entry] = T::select(mask, yes.normal[entry], no.normal[entry]);
        }
        no.dissipation = T::select(mask, yes.dissipation, no.dissipation);
        no
    }
}

impl<T: Copy> Response<T> {
    /// Returns all fields as one array, for comparisons in tests.
    pub(super) fn components(&self) -> [T; 34] {
        let mut all = [self.energy; 34];
        all[1] = self.driving;
        all[2..5].copy_from_slice(&self.stress);
        all[5..8].copy_from_slice(&self.stress_plus);
        all[8..14].copy_from_slice(&self.normal);
        all[14..17].copy_from_slice(&self.shear);
        all[17] = self.driving_slope;
        all[18..21].copy_from_slice(&self.driving_stress);
        all[21..24].copy_from_slice(&self.skew);
        all[24..27].copy_from_slice(&self.oblique.stress);
        all[27..30].copy_from_slice(&self.oblique.stress_plus);
        all[30..33].copy_from_slice(&self.oblique.driving_stress);
        all[33] = self.dissipation;
        all
    }
}
