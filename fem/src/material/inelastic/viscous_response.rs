//! Response of a viscoelastic material at a point: elastic law, Prony terms, damage and mixtures.
//!
//! s is the deviatoric elastic stress: for Hencky's law divided by the shear modulus, for other laws the stress of
//! the law. The deviatoric stress is m_∞ s + Σ m_i dev h_i with the normalised stresses h_i of `viscous_point`. A
//! material of one phase has m_∞ = g γ_∞ μ and m_i = d γ_i μ (for other laws than Hencky's, with 1 instead of μ),
//! where d is g if damage degrades the viscous stress, else 1.
//!
//! In a mixture of matrix and grain, M(c) is the homogenised shear modulus for a matrix with the modulus g c μ
//! (`mixture.rs`). The terms are in the order of increasing relaxation times, and c_i = 1 − γ_1 − … − γ_i is the
//! fraction of the modulus that remains when the terms 1 to i have relaxed. Then m_i = M(c_(i−1)) − M(c_i) and m_∞ =
//! M(γ_∞). The mixture is therefore the elastic mixture at time zero, after infinite time, and at times between
//! relaxation times that are far apart (quasi-elastic approximation of the correspondence principle: Schapery, J.
//! Compos. Mater. 1 (1967) 228). The bulk modulus of the mixture does not relax.

use super::prony::PronyTerm;
use super::viscous_point::{Spatial, ViscousPoint};
use crate::material::mixture::MixedPhases;
use crate::material::number::{Computation, Scalar};
use crate::material::phase_field::DamageEnergies;
use crate::material::principal::Principal;
use crate::material::response::{ElasticResponse, Response, packed};

/// Elastic law at a point, as a sum of a deviatoric and a volumetric part, without damage and relaxation.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct DecoupledLaw<T> {
    /// Response of the deviatoric part, divided by `factor`.
    pub deviatoric: ElasticResponse<T>,
    /// Factor of the deviatoric part: the shear modulus μ (MPa) or one.
    pub factor: T,
    /// Shear modulus of `deviatoric` at small strain.
    pub shear: T,
    /// Energy of the volume change ln J and its first two derivatives, MPa.
    pub volumetric: [T; 3],
    /// Bulk modulus at small strain, MPa.
    pub bulk: T,
}

/// Degradation of a viscoelastic law at a point.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct ViscousDamage<'a, T> {
    pub g: T,
    /// 1 if damage degrades the volumetric energy, else 0.
    pub volume_share: T,
    pub energies: &'a DamageEnergies,
}

/// Response of a viscoelastic point in an increment. This computation is a separate function, so that it is compiled
/// once for each number type.
pub(in crate::material) struct ViscousIncrement<'a, T> {
    pub point: ViscousPoint<'a, T>,
    pub elastic: DecoupledLaw<T>,
    pub phases: &'a Option<MixedPhases<T>>,
    pub damage: ViscousDamage<'a, T>,
    pub trial: &'a Principal<T>,
    pub old: &'a [T],
    pub new: &'a mut [T],
}

/// Modulus as a function of the degradation g: value, first and second derivative.
type Modulus<T> = [T; 3];

/// Sums over the terms of the shear modulus.
struct Shear<T> {
    /// Equilibrium modulus m_∞.
    equilibrium: Modulus<T>,
    /// Coefficient Σ m_i f_i of the elastic stress s, and the derivative of this coefficient with
    /// respect to g.
    viscous: [T; 2],
    /// Stress Σ m_i a_i, which depends only on F and the state at the start of the increment, and
    /// the derivative of this stress with respect to g.
    history_stress: [Spatial<T>; 2],
    /// Stored energy Σ m_i |dev h_i|²/(4 μ) with the modulus μ of the elastic stress, MPa. This expression is exact
    /// at small strain.
    energy: T,
    /// Driving energy of the terms, MPa: `energy` with ∂m_i/∂g instead of m_i if damage degrades the viscous
    /// stress.
    driving: T,
    /// Derivative of `driving` with respect to the strain.
    stress: [T; 6],
    /// Energy that the terms dissipate in the increment, MPa.
    dissipation: T,
}

/// Sums over the terms of the bulk modulus; each factor multiplies a term of the elastic law.
struct Bulk<T> {
    equilibrium: f64,
    viscous: T,
    /// Part of the mean stress that depends only on the state at the start of the increment, MPa.
    history_stress: T,
    energy: T,
    stress: T,
    dissipation: T,
}

impl<T: Scalar> Computation for ViscousIncrement<'_, T> {
    type Output = Response<T>;

    #[inline(always)]
    fn run(self) -> Response<T> {
        let Self { point, elastic, trial, old, .. } = self;
        let instantaneous = point.law.instantaneous()[1];
        point.update_shear(trial, &elastic.deviatoric.stress, old, self.new);
        point.update_pressure(elastic.volumetric[1] * instantaneous, old, self.new);
        let (shear, bulk) = (self.shear(), self.bulk());
        self.combine(&shear, &bulk)
    }
}

impl<T: Scalar> ViscousIncrement<'_, T> {
    /// Returns the shear modulus after a part of the Prony terms has relaxed, as a function of the degradation g.
    /// `fraction` is the remaining fraction of the instantaneous modulus.
    #[inline(always)]
    fn modulus(&self, fraction: f64, degraded: bool) -> Modulus<T> {
        let g = self.damage.g;
        let zero = g.constant(0.0);
        let modulus = self.elastic.factor * (fraction * self.point.law.instantaneous()[0]);
        match self.phases {
            Some(phases) => {
                let shear = phases.shear(modulus, g);
                [shear.value, shear.slope, shear.curvature]
            }
            None if degraded => [g * modulus, modulus, zero],
            None => [modulus, zero, zero],
        }
    }

    #[inline(always)]
    fn shear(&self) -> Shear<T> {
        let Self { point, trial, old, new, .. } = self;
        let zero = self.damage.g.constant(0.0);
        let degraded = self.damage.energies.degrade.viscous;
        let mut history_stress = [[zero; 6]; 2];
        let mut viscous = [zero; 2];
        let [mut energy, mut driving, mut dissipation] = [zero; 3];
        let mut stress = [zero; 6];
        let mut remaining = 1.0;
        let mut above = self.modulus(remaining, degraded);
        for (k, term) in point.law.shear.iter().enumerate() {
            let PronyTerm { fraction, time_s } = *term;
            remaining -= fraction;
            let below = self.modulus(remaining, degraded);
            let m = [above[0] - below[0], above[1] - below[1]];
            above = below;
            let [decay, mean] = point.decay(term);
            for entry in 0..6 {
                let change = decay * old[6 * (1 + k) + entry] - mean * old[entry];
                history_stress[0][entry] = m[0].mul_add(change, history_stress[0][entry]);
                history_stress[1][entry] = m[1].mul_add(change, history_stress[1][entry]);
            }
            viscous[0] = m[0].mul_add(mean, viscous[0]);
            viscous[1] = m[1].mul_add(mean, viscous[1]);
            let state: &[T; 6] = new[6 * (1 + k)..].first_chunk().expect("six values of a term");
            let h = Spatial::new(trial, state).deviator().0;
            let mut square = zero;
            for i in 0..3 {
                square += h[i] * h[i] + h[3 + i] * h[3 + i] * 2.0;
            }
            let stored = square * 0.25 / self.elastic.shear;
            energy += m[0] * stored;
            dissipation += m[0] * stored * self.point.dt * (2.0 / time_s);
            let driven = if degraded { m[1] } else { m[0] };
            driving += driven * stored;
            for entry in 0..6 {
                stress[entry] = (driven * mean).mul_add(h[entry], stress[entry]);
            }
        }
        // damage always degrades the equilibrium spring
        let equilibrium = if degraded { above } else { self.modulus(remaining, true) };
        let history_stress = match point.law.shear.is_empty() {
            true => [Spatial([zero; 6]); 2],
            false => {
                [Spatial::new(trial, &history_stress[0]), Spatial::new(trial, &history_stress[1])]
            }
        };
        Shear { equilibrium, viscous, history_stress, energy, driving, stress, dissipation }
    }

    #[inline(always)]
    fn bulk(&self) -> Bulk<T> {
        let Self { point, old, new, elastic, .. } = self;
        let zero = self.damage.g.constant(0.0);
        let first = point.first_of_bulk();
        let instantaneous = point.law.instantaneous()[1];
        let mut out = Bulk {
            equilibrium: instantaneous,
            viscous: zero,
            history_stress: zero,
            energy: zero,
            stress: zero,
            dissipation: zero,
        };
        for (k, term) in point.law.bulk.iter().enumerate() {
            let [decay, mean] = point.decay(term);
            let at = first + 1 + k;
            out.equilibrium -= term.fraction * instantaneous;
            out.viscous += mean * (term.fraction * instantaneous);
            out.history_stress += (decay * old[at] - mean * old[first]) * term.fraction;
            let stored = new[at] * new[at] / elastic.bulk * (0.5 * term.fraction / instantaneous);
            out.energy += stored;
            out.stress += mean * new[at] * term.fraction;
            out.dissipation += stored * point.dt * (2.0 / term.time_s);
        }
        out
    }

    /// Returns the response: the elastic response, multiplied by the factors in `shear` and `bulk`,
    /// plus the stresses that depend only on the state at the start of the increment.
    #[inline(always)]
    fn combine(&self, shear: &Shear<T>, bulk: &Bulk<T>) -> Response<T> {
        let ViscousDamage { g, volume_share, energies } = self.damage;
        let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
        let DecoupledLaw { deviatoric, volumetric: [u, u_slope, u_curvature], .. } = &self.elastic;
        let viscous = if energies.degrade.viscous { [g, one] } else { [one, zero] };
        let volume = self.volume(bulk, viscous);
        let mut out = Response::zero(g);
        out.energy = shear.equilibrium[0] * deviatoric.energy + volume.energy * *u;
        out.driving = shear.equilibrium[1] * deviatoric.energy + volume.driving[0] * *u;
        out.driving_slope = shear.equilibrium[2] * deviatoric.energy + volume.driving[1] * *u;
        let spared = volume_share.mul_add(viscous[0] - one, one);
        out.energy += shear.energy + spared * bulk.energy;
        out.dissipation = shear.dissipation + spared * bulk.dissipation;
        let pressure = volume.stress * *u_slope + spared * bulk.history_stress;
        let pressure_plus =
            volume.stress_slope * *u_slope + volume_share * viscous[1] * bulk.history_stress;
        let factor = shear.equilibrium[0] + shear.viscous[0];
        let factor_slope = shear.equilibrium[1] + shear.viscous[1];
        let third = shear.history_stress[0].trace() / 3.0;
        let [history, history_slope] = shear.history_stress.map(Spatial::deviator);
        for i in 0..3 {
            let (stress, a) = (deviatoric.stress[i], history.0[i]);
            out.stress[i] = factor * stress + a + pressure;
            out.stress_plus[i] = factor_slope * stress + history_slope.0[i] + pressure_plus;
            out.driving_stress[i] = shear.equilibrium[1] * stress + volume.driving[0] * *u_slope;
            for k in 0..=i {
                // 2 t (δ − ⅓) − ⅔ (a_i + a_k) + 2 δ a_i: a is the deviator, t a third of the trace, and δ = 1 for i = k
                let mut moved = (a + history.0[k] + third) * (-2.0 / 3.0);
                if i == k {
                    moved += (third + a) * 2.0;
                }
                let entry = packed(i, k);
                let elastic = factor * deviatoric.normal[entry] + volume.stress * *u_curvature;
                out.normal[entry] = elastic + moved;
            }
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let moved = third + (history.0[j] + history.0[k]) * 0.5;
            out.shear[i] = factor * deviatoric.shear[i] + moved;
            out.oblique.stress[i] = history.0[3 + i];
            out.oblique.stress_plus[i] = history_slope.0[3 + i];
        }
        if energies.drive.viscous {
            out.driving += shear.driving + volume_share * bulk.energy;
            for i in 0..3 {
                out.driving_stress[i] += shear.stress[i] + volume_share * bulk.stress;
                out.oblique.driving_stress[i] = shear.stress[3 + i];
            }
        }
        out
    }

    /// Returns the factors of the volumetric elastic energy.
    #[inline(always)]
    fn volume(&self, bulk: &Bulk<T>, viscous: [T; 2]) -> Volume<T> {
        let ViscousDamage { g, volume_share, .. } = self.damage;
        let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
        if let Some(phases) = self.phases {
            let whole = match T::settled(volume_share.equals(one)) {
                true => [zero; 2],
                false => phases.whole(),
            };
            let [modulus, _] = phases.moduli(whole, g);
            // the factors are relative to the elastic law, which has the bulk modulus of the matrix
            let unit = one / self.elastic.bulk;
            let value = unit * modulus.degraded(volume_share);
            let slope = unit * volume_share * modulus.slope;
            let curvature = unit * volume_share * modulus.curvature;
            return Volume {
                stress: value,
                stress_slope: slope,
                energy: value,
                driving: [slope, curvature],
            };
        }
        let spared = |x: T| volume_share.mul_add(x - one, one);
        Volume {
            stress: spared(g) * bulk.equilibrium + spared(viscous[0]) * bulk.viscous,
            stress_slope: volume_share * (bulk.viscous * viscous[1] + bulk.equilibrium),
            energy: spared(g) * bulk.equilibrium,
            driving: [volume_share * bulk.equilibrium, zero],
        }
    }
}

/// Factors by which the terms of the volumetric elastic energy are multiplied.
struct Volume<T> {
    /// Factor of the stress.
    stress: T,
    /// Derivative of `stress` with respect to g.
    stress_slope: T,
    /// Factor by which the volumetric elastic energy is multiplied to obtain the stored energy.
    energy: T,
    /// Factor by which the volumetric elastic energy is multiplied to obtain the driving energy,
    /// and the derivative of this factor with respect to g.
    driving: [T; 2],
}
