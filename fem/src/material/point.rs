//! Material constants of one region for quadrature points, and laws of several elements in SIMD lanes.

use super::crack_density::CrackDensity;
use super::law::{Elasticity, Moduli, hencky, neo_hookean};
use super::mixture::{MixedPhases, Modulus};
use super::number::{Lanes, POINTS, Scalar};
use super::phase_field::Split;
use super::point_law::PointLaw;
use super::principal::{Principal, Strains};
use super::response::Response;

/// Material constants of one region, in the form used at quadrature points.
#[derive(Clone, Debug)]
pub struct PointMaterial {
    pub elasticity: Elasticity,
    pub moduli: Moduli,
    /// Damage constants; `None`: elastic.
    pub damage: Option<Damage>,
}

/// Damage constants of one region.
#[derive(Clone, Copy, Debug)]
pub struct Damage {
    pub degraded: Degraded,
    pub density: CrackDensity,
    /// Whether the largest driving energy so far drives damage.
    pub history: bool,
    /// Residual stiffness η.
    pub residual: f64,
    /// Gc/(c₀ ℓ₀), MPa.
    pub local: f64,
    /// Gc ℓ₀/c₀, N.
    pub gradient: f64,
    /// Viscosity ξ, MPa s.
    pub viscosity: f64,
}

/// Part of the energy that damage degrades; the same in all regions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Degraded {
    pub split: Split,
    /// Whether the split applies to the driving energy only.
    pub hybrid: bool,
}

impl Degraded {
    /// The whole energy is degraded. Also used for elastic materials.
    pub const ALL: Self = Self { split: Split::None, hybrid: false };
}

/// Law with explicit derivatives, for any scalar type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Formula {
    Hencky,
    NeoHookean,
}

/// Law with explicit derivatives, with its bulk and shear modulus.
#[derive(Clone, Copy, Debug)]
pub struct FormulaLaw<T> {
    pub formula: Formula,
    pub degraded: Degraded,
    /// Bulk and shear modulus without damage.
    pub moduli: [T; 2],
    /// Phases of a mixture, for Hencky's law; `None`: damage degrades the moduli as a whole.
    pub phases: Option<MixedPhases<T>>,
}

impl<T: Scalar> FormulaLaw<T> {
    #[inline(always)]
    fn degraded_moduli(&self, g: T) -> [Modulus<T>; 2] {
        let [bulk, shear] = self.moduli;
        match &self.phases {
            Some(phases) => phases.moduli(self.moduli, g),
            None => [Modulus::proportional(bulk, g), Modulus::proportional(shear, g)],
        }
    }
}

impl<T: Scalar> PointLaw<T> for FormulaLaw<T> {
    #[inline(always)]
    fn state_len(&self) -> usize {
        0
    }

    #[inline(always)]
    fn respond<const TANGENT: bool>(
        &self,
        Principal { strains, .. }: &Principal<T>,
        g: T,
        _dt: T,
        _old: &[T],
        _new: &mut [T],
    ) -> Response<T> {
        self.response::<TANGENT>(strains, g)
    }
}

impl<T: Scalar> FormulaLaw<T> {
    /// Returns the response at the given strains.
    #[inline(always)]
    pub(super) fn response<const TANGENT: bool>(&self, strains: &Strains<T>, g: T) -> Response<T> {
        let Self { degraded: Degraded { split, hybrid }, moduli, .. } = *self;
        match self.formula {
            Formula::Hencky => {
                let moduli = self.degraded_moduli(g);
                hencky::respond::<T, TANGENT>(split, hybrid, &moduli, strains)
            }
            Formula::NeoHookean => {
                let [bulk, shear] = moduli;
                let moduli = [bulk - g.constant(2.0 / 3.0) * shear, shear];
                let mut spared = [g.constant(0.0); 3];
                if split == Split::VolumetricDeviatoric {
                    spared = neo_hookean::of_volume(moduli, strains.trace());
                }
                neo_hookean::whole(moduli, strains).split(spared, strains.trace(), hybrid, g)
            }
        }
    }
}

impl PointMaterial {
    /// Returns the number of state values of the law at a point, without the largest driving energy.
    pub fn state_len(&self) -> usize {
        0
    }

    /// Returns the formula of the law; `None` for a user-defined law.
    pub fn formula(&self) -> Option<Formula> {
        match self.elasticity {
            Elasticity::Hencky { .. } => Some(Formula::Hencky),
            Elasticity::NeoHookean { .. } => Some(Formula::NeoHookean),
            Elasticity::User(_) => None,
        }
    }
}

impl PointMaterial {
    /// Returns the response at the given strains.
    pub(super) fn response<const TANGENT: bool>(
        &self,
        strains: &Strains<f64>,
        g: f64,
    ) -> Response<f64> {
        let degraded = self.damage.map_or(Degraded::ALL, |d| d.degraded);
        let (formula, trace) = (self.formula(), strains.trace());
        match (&self.elasticity, formula) {
            (Elasticity::User(law), _) => {
                let splits = degraded.split == Split::VolumetricDeviatoric && trace < 0.0;
                let spared = if splits { law.of_volume(trace) } else { [0.0; 3] };
                law.whole(strains, TANGENT).split(spared, trace, degraded.hybrid, g)
            }
            (_, formula) => {
                let moduli = [self.moduli.bulk, self.moduli.shear];
                let formula = formula.unwrap_or(Formula::Hencky);
                FormulaLaw { formula, degraded, moduli, phases: None }
                    .response::<TANGENT>(strains, g)
            }
        }
    }
}

/// Laws of several elements, one per lane.
///
/// If all lanes have the same formula, it is evaluated for all lanes at once. User-defined laws and different
/// formulas are evaluated lane by lane.
#[derive(Clone, Copy, Debug)]
pub struct LaneLaw<'a, T> {
    formula: Option<FormulaLaw<T>>,
    materials: [&'a PointMaterial; POINTS],
}

impl<'a, T: Lanes> LaneLaw<'a, T> {
    /// Creates the laws of the materials of each lane, with these moduli, or with these phases for mixtures.
    /// `formula` is the formula of all materials of the mesh, if they have a common one; mixtures require it.
    #[inline(always)]
    pub fn new(
        formula: Option<Formula>,
        degraded: Degraded,
        mut moduli: [T; 2],
        phases: Option<MixedPhases<T>>,
        materials: [&'a PointMaterial; POINTS],
    ) -> Self {
        if let Some(phases) = &phases {
            moduli = phases.whole();
        }
        let mut formula = formula;
        if formula.is_none() {
            let first = materials[0].formula();
            formula = first.filter(|_| materials[..T::COUNT].iter().all(|m| m.formula() == first));
        }
        let formula = match formula {
            Some(formula) => Some(FormulaLaw { formula, degraded, moduli, phases }),
            None => None,
        };
        Self { formula, materials }
    }

    /// Returns the formula that all lanes have in common, if any.
    pub fn formula(&self) -> Option<FormulaLaw<T>> {
        self.formula
    }
}

impl<T: Lanes> PointLaw<T> for LaneLaw<'_, T> {
    #[inline(always)]
    fn state_len(&self) -> usize {
        0
    }

    #[inline(always)]
    fn respond<const TANGENT: bool>(
        &self,
        Principal { strains, .. }: &Principal<T>,
        g: T,
        _dt: T,
        _old: &[T],
        _new: &mut [T],
    ) -> Response<T> {
        if let Some(formula) = &self.formula {
            return formula.response::<TANGENT>(strains, g);
        }
        let inputs = [strains.log, strains.excess, strains.coth];
        let mut lanes = [[[0.0; POINTS]; 3]; 3];
        let mut softness = [0.0; POINTS];
        g.store(&mut softness);
        for (part, lanes) in inputs.iter().zip(&mut lanes) {
            for i in 0..3 {
                part[i].store(&mut lanes[i]);
            }
        }
        let materials = &self.materials[..T::COUNT];
        let numbers = each_lane::<TANGENT>(materials, &lanes, &softness);
        let mut response = [g; Response::<f64>::NUMBERS];
        for (number, lanes) in response.iter_mut().zip(&numbers) {
            *number = T::load(g.token(), lanes);
        }
        Response::from_numbers(&response)
    }
}

/// Evaluates the responses lane by lane, each with its own law. Returns each number of the response for all lanes.
#[inline(never)]
fn each_lane<const TANGENT: bool>(
    materials: &[&PointMaterial],
    strains: &[[[f64; POINTS]; 3]; 3],
    g: &[f64; POINTS],
) -> [[f64; POINTS]; Response::<f64>::NUMBERS] {
    let mut out = [[0.0; POINTS]; Response::<f64>::NUMBERS];
    for (lane, material) in materials.iter().enumerate() {
        let of = |part: &[[f64; POINTS]; 3]| part.map(|numbers| numbers[lane]);
        let [log, excess, coth] = strains.each_ref().map(of);
        let response = material.response::<TANGENT>(&Strains { log, excess, coth }, g[lane]);
        for (lanes, number) in out.iter_mut().zip(response.numbers()) {
            lanes[lane] = number;
        }
    }
    out
}
