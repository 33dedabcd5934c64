//! Laws of the regions of a mesh, and the law of the elements in SIMD lanes.

use super::inelastic::{
    DecoupledLaw, Inelasticity, PlasticPoint, Plasticity, Viscoelasticity, ViscousDamage,
    ViscousIncrement, ViscousPoint,
};
use super::law::{Elasticity, MOST_STATE, UserConstitutiveLaw, UserLaw, hencky, neo_hookean};
use super::mixture::{MixedPhases, Modulus};
use super::number::Scalar;
use super::phase_field::DamageEnergies;
use super::point_law::PointLaw;
use super::principal::Principal;
use super::response::{ElasticResponse, Response};
use super::split::{Degraded, ElasticPoint, PointSplit, Split};
use super::strength::ExternalDrive;

/// Law of a region without its moduli. Regions with the same law are evaluated together.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionLaw {
    pub form: LawForm,
    /// Viscous or plastic part; `None`: the law is elastic, or a user-defined law with a state.
    pub inelastic: Option<Inelasticity>,
    pub degraded: Degraded,
    pub energies: DamageEnergies,
    /// External driving force of a material with a strength.
    pub strength: Option<ExternalDrive>,
}

/// Form of an elastic law, without its moduli.
#[derive(Clone, Debug, PartialEq)]
pub enum LawForm {
    Hencky,
    NeoHookean,
    /// User-defined law that is given by its energy.
    Energy(UserLaw),
    Constitutive(UserConstitutiveLaw),
}

impl LawForm {
    pub(super) fn new(elasticity: &Elasticity) -> Self {
        match elasticity {
            Elasticity::Hencky { .. } => Self::Hencky,
            Elasticity::NeoHookean { .. } => Self::NeoHookean,
            Elasticity::User(law) => Self::Energy(law.clone()),
            Elasticity::Constitutive(law) => Self::Constitutive(law.clone()),
        }
    }
}

/// Elastic constants of a point.
#[derive(Clone, Copy, Debug)]
struct Constants<'a, T> {
    /// Bulk and shear modulus without damage.
    moduli: [T; 2],
    phases: &'a Option<MixedPhases<T>>,
}

impl<T: Scalar> Constants<'_, T> {
    #[inline(always)]
    fn degraded_moduli(&self, g: T) -> [Modulus<T>; 2] {
        let [bulk, shear] = self.moduli;
        match self.phases {
            Some(phases) => phases.moduli(self.moduli, g),
            None => [Modulus::proportional(bulk, g), Modulus::proportional(shear, g)],
        }
    }

    /// Returns Lamé's constant λ and the shear modulus.
    #[inline(always)]
    fn lame(&self) -> [T; 2] {
        let [bulk, shear] = self.moduli;
        [bulk - shear.constant(2.0 / 3.0) * shear, shear]
    }
}

impl RegionLaw {
    /// Returns the number of state values of a point.
    pub fn state_len(&self) -> usize {
        match (&self.inelastic, &self.form) {
            (Some(law), _) => law.state_len(),
            (None, LawForm::Constitutive(law)) => law.state_len(),
            _ => 0,
        }
    }

    /// Returns whether the law has a plastic strain, which is C_p⁻¹ − I in the first six state values.
    #[inline(always)]
    fn is_plastic(&self) -> bool {
        matches!(self.inelastic, Some(Inelasticity::Plastic(_)))
    }

    /// Returns whether stresses may have components outside the principal axes of the strain.
    #[inline(always)]
    pub fn is_oblique(&self) -> bool {
        matches!(self.inelastic, Some(Inelasticity::Viscoelastic(_)))
    }

    #[inline(always)]
    fn respond<T: Scalar, const TANGENT: bool>(
        &self,
        constants: Constants<T>,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        match &self.inelastic {
            Some(Inelasticity::Plastic(law)) => {
                return self.plastic(law, constants, trial, g, dt, old, new);
            }
            Some(Inelasticity::Viscoelastic(law)) => {
                return self.viscoelastic(law, constants, trial, g, dt, old, new);
            }
            None => {}
        }
        let out = self.elastic::<T, TANGENT>(constants, trial, g, dt, old, new);
        match self.strength {
            Some(drive) => drive.add_to::<T, TANGENT>(out, g),
            None => out,
        }
    }

    /// Returns the response of a law without Prony series and plasticity.
    #[inline(always)]
    fn elastic<T: Scalar, const TANGENT: bool>(
        &self,
        constants: Constants<T>,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let strains = &trial.strains;
        let Degraded { split, hybrid } = &self.degraded;
        let whole = match &self.form {
            LawForm::Hencky => {
                // one call for both cases: the inlined function is then compiled only once
                let (split, at) = match split {
                    PointSplit::Standard(split) => (*split, g),
                    PointSplit::User(_) => (Split::None, g.constant(1.0)),
                };
                let moduli = constants.degraded_moduli(at);
                let out = hencky::respond::<T, TANGENT>(split, *hybrid, &moduli, strains);
                if matches!(self.degraded.split, PointSplit::Standard(_)) {
                    return out;
                }
                out.elastic()
            }
            LawForm::NeoHookean => neo_hookean::whole(constants.lame(), strains),
            LawForm::Energy(law) => law.whole::<T, TANGENT>(strains),
            LawForm::Constitutive(law) => return law.respond(trial, g, dt, old, new),
        };
        let trace = strains.trace();
        if !self.degraded.spares(trace) {
            return whole.degraded(g);
        }
        let volumetric = self.volumetric(constants, trace);
        self.degraded.respond(&ElasticPoint::new(strains, whole, volumetric, constants.moduli), g)
    }

    /// Returns 1 if damage degrades the volumetric energy at the volume change `trace` = tr ε, else
    /// 0.
    #[inline(always)]
    fn volume_share<T: Scalar>(&self, trace: T) -> T {
        let [zero, one] = [0.0, 1.0].map(|x| trace.constant(x));
        match &self.degraded.split {
            PointSplit::Standard(Split::VolumetricDeviatoric) => {
                T::select(trace.less_than(zero), zero, one)
            }
            _ => one,
        }
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "values of one point, which only this call passes"
    )]
    #[inline(always)]
    fn plastic<T: Scalar>(
        &self,
        law: &Plasticity,
        constants: Constants<T>,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let [bulk, shear] = constants.moduli;
        let volume_share = self.volume_share(trial.strains.trace());
        let energies = &self.energies;
        PlasticPoint { law, bulk, shear, volume_share, energies, g, dt }.respond(trial, old, new)
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "values of one point, which only this call passes"
    )]
    #[inline(always)]
    fn viscoelastic<T: Scalar>(
        &self,
        law: &Viscoelasticity,
        constants: Constants<T>,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let strains = &trial.strains;
        let one = g.constant(1.0);
        // in a mixture, these are the moduli of the matrix
        let [bulk, modulus] = constants.phases.as_ref().map_or(constants.moduli, |p| p.matrix);
        let volumetric = match &self.form {
            LawForm::Energy(law) => law.volumetric(strains.trace()),
            _ => hencky::volumetric(bulk, strains.trace()),
        };
        let (deviatoric, factor, shear) = match &self.form {
            LawForm::Energy(law) => {
                (law.whole::<T, true>(strains).without_volume(volumetric), one, modulus)
            }
            _ => (hencky::deviatoric(one, strains), modulus, one),
        };
        let elastic = DecoupledLaw { deviatoric, factor, shear, volumetric, bulk };
        let volume_share = self.volume_share(strains.trace());
        let damage = ViscousDamage { g, volume_share, energies: &self.energies };
        let (point, phases) = (ViscousPoint { law, dt }, constants.phases);
        g.vectorize(ViscousIncrement { point, elastic, phases, damage, trial, old, new })
    }

    /// Returns the energy U(t) of a pure change of volume with t = tr ε, and its derivatives U′ and U″, MPa.
    #[inline(always)]
    fn volumetric<T: Scalar>(&self, constants: Constants<T>, t: T) -> [T; 3] {
        match &self.form {
            LawForm::NeoHookean => neo_hookean::volumetric(constants.lame(), t),
            LawForm::Energy(law) => law.volumetric(t),
            LawForm::Hencky | LawForm::Constitutive(_) => {
                hencky::volumetric(constants.moduli[0], t)
            }
        }
    }
}

/// Law of an element, or of one element per SIMD lane, selected from the laws of the mesh.
///
/// Each law of the mesh is evaluated for all lanes at once, and skipped if no lane has this law.
#[derive(Clone, Copy, Debug)]
pub struct LaneLaw<'a, T> {
    /// The laws of the mesh, at least one.
    pub laws: &'a [RegionLaw],
    /// Index into `laws`.
    pub law: T,
    /// Bulk and shear modulus without damage.
    pub moduli: [T; 2],
    /// Phases of a mixture, used by Hencky's law. `None`: no element is a mixture, and damage multiplies the moduli
    /// by g.
    pub phases: Option<MixedPhases<T>>,
}

impl<'a, T: Scalar> LaneLaw<'a, T> {
    /// Creates the law. With `phases`, the moduli follow from the phases, and `moduli` is ignored.
    #[inline(always)]
    pub fn new(
        laws: &'a [RegionLaw],
        law: T,
        mut moduli: [T; 2],
        phases: Option<MixedPhases<T>>,
    ) -> Self {
        if let Some(phases) = &phases {
            moduli = phases.whole();
        }
        Self { laws, law, moduli, phases }
    }
}

impl<T: Scalar> PointLaw<T> for LaneLaw<'_, T> {
    /// Returns the trial deformation: the elastic part in lanes of plastic laws, the whole deformation in other lanes.
    #[inline(always)]
    fn trial(&self, h: &[[T; 3]; 3], old: &[T]) -> Principal<T> {
        if !self.laws.iter().any(RegionLaw::is_plastic) {
            return Principal::new(h);
        }
        let mut plastic: [T; 6] = *old.first_chunk().expect("a plastic law has more state values");
        if self.laws.len() > 1 {
            let zero = self.law.constant(0.0);
            for (k, law) in self.laws.iter().enumerate() {
                if law.is_plastic() {
                    continue;
                }
                let mask = self.law.equals(self.law.constant(k as f64));
                for entry in 0..6 {
                    plastic[entry] = T::select(mask, zero, plastic[entry]);
                }
            }
        }
        Principal::of_elastic_part(h, Some(&plastic))
    }

    #[inline(always)]
    fn is_oblique(&self) -> bool {
        self.laws.iter().any(RegionLaw::is_oblique)
    }

    /// Returns the largest number of state values among the laws of the mesh.
    #[inline(always)]
    fn state_len(&self) -> usize {
        let mut most = 0;
        for law in self.laws {
            most = most.max(law.state_len());
        }
        most
    }

    #[inline(always)]
    fn respond<const TANGENT: bool>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let constants = Constants { moduli: self.moduli, phases: &self.phases };
        let (zero, several) = (g.constant(0.0), self.laws.len() > 1);
        let mut out = ElasticResponse::zero(g).degraded(g);
        let mut scratch: Option<[T; MOST_STATE]> = None;
        // one call for all cases: each inlined law is then compiled only once
        for (k, law) in self.laws.iter().enumerate() {
            let mask = self.law.equals(g.constant(k as f64));
            let absent = T::select(mask, g.constant(1.0), zero).equals(zero);
            if several && T::settled(absent) {
                continue;
            }
            let state = match &mut scratch {
                // clear the state of the previous law: this law may write fewer state values
                Some(state) => {
                    state.fill(zero);
                    &mut state[..]
                }
                None if several && !new.is_empty() => &mut scratch.insert([zero; MOST_STATE])[..],
                None => &mut *new,
            };
            let response = law.respond::<T, TANGENT>(constants, trial, g, dt, old, state);
            if !several {
                return response;
            }
            out = Response::select(mask, response, out);
            if let Some(state) = &scratch {
                for (new, value) in new.iter_mut().zip(state) {
                    *new = T::select(mask, *value, *new);
                }
            }
        }
        out
    }
}
