//! Response of a viscoelastic material at a point: elastic law, Prony series, damage and mixtures.
//!
//! The deviatoric elastic law is given for a unit factor: energy w, stress s, tangent. A pure material has the stress
//! m s + d dev a with m = g γ_∞ + d Σ γ_i f_i and d = g or 1 (damage degrades the viscous stress or not). In a mixture
//! of matrix and grain, the homogenised shear modulus M(g) of a matrix with the modulus c μ, c = γ_∞ + Σ γ_i f_i,
//! replaces m. The mean strain of the matrix is A e + (1 − A) g dev a/(2 D) with D = μ_g − g c μ and (1 − f) A = (μ_g
//! − M)/D; the stress of the mixture contains (1 − f) A g dev a (Levin's theorem for two phases: Levin, Mech. Solids 2
//! (1967) 58). Without viscosity, the mixture is elastic as in `mixture.rs`.

use super::viscous_point::{Overstress, ViscousPoint};
use crate::material::law::hencky;
use crate::material::mixture::{MixedPhases, Modulus};
use crate::material::number::{Computation, Scalar};
use crate::material::phase_field::DamageEnergies;
use crate::material::principal::Principal;
use crate::material::response::{ElasticResponse, Response, packed};

/// Elastic law at a point, as a sum of a deviatoric and a volumetric part, without damage and relaxation.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct DecoupledLaw<T> {
    pub deviatoric: ElasticResponse<T>,
    /// Energy of the volume change ln J and its first two derivatives, MPa.
    pub volumetric: [T; 3],
    /// Bulk and shear modulus at small strain, MPa.
    pub moduli: [T; 2],
}

/// Damage at a point, as it acts on a viscoelastic law.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct ViscousDamage<'a, T> {
    pub g: T,
    /// 1 if damage degrades the volumetric energy, 0 if damage does not.
    pub volume_share: T,
    pub energies: &'a DamageEnergies,
}

/// Factors of one part (deviatoric or volumetric) of the elastic law.
struct Factors<T> {
    /// Factor of the elastic stress.
    stress: T,
    /// Derivative of `stress` with respect to g.
    stress_slope: T,
    /// Factor of the stored elastic energy.
    energy: T,
    /// Factor of the elastic energy in the driving energy, and its derivative with respect to g.
    driving: [T; 2],
    /// Factor of the stress that the state determines, and its derivative with respect to g.
    known: [T; 2],
}

/// Response of a viscoelastic point in an increment. A function of its own, so that it is compiled once for each number
/// type.
pub(in crate::material) struct ViscousIncrement<'a, T> {
    pub point: ViscousPoint<'a, T>,
    pub elastic: DecoupledLaw<T>,
    pub phases: &'a Option<MixedPhases<T>>,
    pub damage: ViscousDamage<'a, T>,
    pub trial: &'a Principal<T>,
    pub old: &'a [T],
    pub new: &'a mut [T],
}

impl<T: Scalar> Computation for ViscousIncrement<'_, T> {
    type Output = Response<T>;

    #[inline(always)]
    fn run(self) -> Response<T> {
        let Self { point, elastic, phases, damage, trial, old, new } = self;
        point.respond(elastic, phases, damage, trial, old, new)
    }
}

impl<T: Scalar> ViscousPoint<'_, T> {
    /// Returns the response, and writes the state at the end of the increment.
    #[inline(always)]
    fn respond(
        &self,
        mut elastic: DecoupledLaw<T>,
        phases: &Option<MixedPhases<T>>,
        damage: ViscousDamage<'_, T>,
        trial: &Principal<T>,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let ViscousDamage { g, volume_share, energies } = damage;
        let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
        let viscous = if energies.degrade.viscous { [g, one] } else { [one, zero] };
        let over = self.overstress(trial, old);
        let [bulk_modulus, shear_modulus] = elastic.moduli;
        let (shear, bulk) = (self.shear(), self.bulk());
        let whole = shear.equilibrium + shear.viscous;
        // stress of the matrix, without damage and relaxation
        let mut matrix = [zero; 6];
        let mut matrix_share = one;
        let deviatoric_factors;
        let volume_factors;
        if let Some(phases) = phases {
            let mut relaxed = *phases;
            relaxed.matrix[1] = whole * phases.matrix[1];
            let ends =
                if T::settled(volume_share.equals(one)) { [zero; 2] } else { relaxed.whole() };
            let [bulk, shear_of_g] = relaxed.moduli(ends, g);
            let share = shear.equilibrium / whole;
            let pure = phases.fraction.equals(zero);
            let (known, matrix_strain) = localisation(&relaxed, &shear_of_g, g, pure);
            deviatoric_factors = Factors {
                stress: shear_of_g.value,
                stress_slope: shear_of_g.slope,
                energy: share * shear_of_g.value,
                driving: [share * shear_of_g.slope, share * shear_of_g.curvature],
                known,
            };
            volume_factors = Factors {
                stress: bulk.degraded(volume_share),
                stress_slope: volume_share * bulk.slope,
                energy: bulk.degraded(volume_share),
                driving: [volume_share * bulk.slope, volume_share * bulk.curvature],
                known: [zero; 2],
            };
            matrix_share = one - phases.fraction;
            let modulus = phases.matrix[1] * shear.instantaneous * 2.0;
            for i in 0..3 {
                let e = trial.strains.log[i] - trial.strains.trace() / 3.0;
                matrix[i] = matrix_strain[0] * e;
            }
            elastic.deviatoric = hencky::deviatoric(one, &trial.strains);
            let t = trial.strains.trace();
            elastic.volumetric = [t * t * 0.5, t, one];
            for entry in 0..6 {
                let strain = matrix_strain[1].mul_add(over.deviator[entry], matrix[entry]);
                matrix[entry] = modulus * strain;
            }
        } else {
            deviatoric_factors = Factors {
                stress: g * shear.equilibrium + viscous[0] * shear.viscous,
                stress_slope: shear.equilibrium + viscous[1] * shear.viscous,
                energy: g * shear.equilibrium,
                driving: [shear.equilibrium, zero],
                known: viscous,
            };
            let spared = |x: T| volume_share.mul_add(x - one, one);
            volume_factors = Factors {
                stress: spared(g) * bulk.equilibrium + spared(viscous[0]) * bulk.viscous,
                stress_slope: volume_share * (bulk.equilibrium + viscous[1] * bulk.viscous),
                energy: spared(g) * bulk.equilibrium,
                driving: [volume_share * bulk.equilibrium, zero],
                known: [spared(viscous[0]), volume_share * viscous[1]],
            };
            for i in 0..3 {
                matrix[i] = shear.instantaneous * elastic.deviatoric.stress[i];
            }
        }
        let known_pressure = self.known_pressure(old);
        self.update_shear(trial, &matrix, old, new);
        self.update_pressure(bulk.instantaneous * elastic.volumetric[1], old, new);
        let stored = self.stored(
            trial,
            shear.instantaneous * shear_modulus,
            bulk.instantaneous * bulk_modulus,
            new,
        );
        let mut out =
            combine(&elastic, &deviatoric_factors, &volume_factors, &over, known_pressure, trial);
        out.energy += viscous[0] * matrix_share * stored.energy;
        out.dissipation = viscous[0] * matrix_share * stored.dissipation;
        if energies.drive.viscous {
            out.driving += matrix_share * stored.energy;
            for i in 0..3 {
                out.driving_stress[i] += matrix_share * stored.stress[i];
                out.oblique.driving_stress[i] = matrix_share * stored.stress[3 + i];
            }
        }
        out
    }
}

/// Returns the factor (1 − f) A g of the known stress in a mixture with its derivative with respect to g, and the
/// factors of the strain and of the known stress in the mean strain of the matrix. `pure` marks elements without grain.
#[inline(always)]
fn localisation<T: Scalar>(
    phases: &MixedPhases<T>,
    shear: &Modulus<T>,
    g: T,
    pure: T::Mask,
) -> ([T; 2], [T; 2]) {
    let [zero, one] = [0.0, 1.0].map(|x| g.constant(x));
    let matrix = phases.matrix[1];
    let difference = phases.grain[1] - g * matrix;
    let difference = T::select(pure, one, difference);
    let share = (phases.grain[1] - shear.value) / difference;
    let share_slope = (share * matrix - shear.slope) / difference;
    let share = T::select(pure, one, share);
    let share_slope = T::select(pure, zero, share_slope);
    let strain = share / (one - phases.fraction);
    let of_known = (one - strain) * g / (difference * 2.0);
    ([g * share, g * share_slope + share], [strain, of_known])
}

/// Returns the sum of the elastic parts with their factors and of the known stresses.
#[inline(always)]
fn combine<T: Scalar>(
    elastic: &DecoupledLaw<T>,
    shape: &Factors<T>,
    volume: &Factors<T>,
    over: &Overstress<T>,
    known_pressure: T,
    trial: &Principal<T>,
) -> Response<T> {
    let DecoupledLaw { deviatoric, volumetric: [u, u_slope, u_curvature], .. } = elastic;
    let mut out = Response::zero(trial.strains.trace());
    out.energy = shape.energy * deviatoric.energy + volume.energy * *u;
    out.driving = shape.driving[0] * deviatoric.energy + volume.driving[0] * *u;
    out.softening = shape.driving[1] * deviatoric.energy + volume.driving[1] * *u;
    let pressure = volume.stress * *u_slope + volume.known[0] * known_pressure;
    let pressure_plus = volume.stress_slope * *u_slope + volume.known[1] * known_pressure;
    let third = over.trace / 3.0;
    let known = shape.known[0];
    for i in 0..3 {
        let (stress, a) = (deviatoric.stress[i], over.deviator[i]);
        out.stress[i] = shape.stress * stress + known * a + pressure;
        out.stress_plus[i] = shape.stress_slope * stress + shape.known[1] * a + pressure_plus;
        out.driving_stress[i] = shape.driving[0] * stress + volume.driving[0] * *u_slope;
        for k in 0..=i {
            let entry = packed(i, k);
            let b = over.deviator[k];
            // ⅔ tr a (δ − ⅓) − ⅔ (a_i + a_k) + 2 δ a_i
            let mut moved = (a + b + third) * (-2.0 / 3.0);
            if i == k {
                moved += (third + a) * 2.0;
            }
            out.normal[entry] = shape.stress * deviatoric.normal[entry]
                + volume.stress * *u_curvature
                + known * moved;
        }
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let moved = third + (over.deviator[j] + over.deviator[k]) * 0.5;
        out.shear[i] = shape.stress * deviatoric.shear[i] + known * moved;
        out.oblique.stress[i] = known * over.deviator[3 + i];
        out.oblique.stress_plus[i] = shape.known[1] * over.deviator[3 + i];
    }
    out
}
