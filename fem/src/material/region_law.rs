//! Laws of the regions of a mesh, and the law of the elements in SIMD lanes.

use super::law::{Elasticity, MOST_STATE, UserConstitutiveLaw, UserLaw, hencky, neo_hookean};
use super::mixture::{MixedPhases, Modulus};
use super::number::Scalar;
use super::point_law::PointLaw;
use super::principal::Principal;
use super::response::{ElasticResponse, Response};
use super::split::{Degraded, ElasticPoint, PointSplit, Split};

/// Law of a region without its moduli. Regions with the same law are evaluated together.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionLaw {
    pub form: LawForm,
    pub degraded: Degraded,
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
        match &self.form {
            LawForm::Constitutive(law) => law.state_len(),
            _ => 0,
        }
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
                // without the state of the law before: a law may have fewer state values
                Some(state) => {
                    state.fill(zero);
                    &mut state[..]
                }
                None if several && !new.is_empty() => &mut scratch.insert([zero; MOST_STATE])[..],
                None => &mut *new,
            };
            let own = law.respond::<T, TANGENT>(constants, trial, g, dt, old, state);
            if !several {
                return own;
            }
            out = Response::select(mask, own, out);
            if let Some(state) = &scratch {
                for (new, own) in new.iter_mut().zip(state) {
                    *new = T::select(mask, *own, *new);
                }
            }
        }
        out
    }
}
