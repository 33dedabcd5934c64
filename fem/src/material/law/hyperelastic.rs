//! User-defined elastic law given by its energy; stress and tangent are derivatives of the energy.

use std::fmt::Debug;
use std::sync::Arc;

use crate::error::{FemError, Unsupported};
use crate::material::number::{Computation, Family, Jet, MemberOf, OverScalars, Scalar};
use crate::material::principal::Strains;
use crate::material::response::{ElasticResponse, packed};
use crate::material::strain::PrincipalStrain;

/// Isotropic hyperelastic law, given by its energy alone.
///
/// ψ, the energy per reference volume in MPa = N mm/mm³, is written once, for any number type ([`Scalar`]). It must
/// be a symmetric function of the principal strains, with zero energy and stress at rest. The Kirchhoff stress τ_i =
/// ∂ψ/∂ε_i and the consistent tangent are computed from the energy by automatic differentiation, and are exact also
/// at equal stretches. The law runs in SIMD lanes and on devices as the laws of this crate do. The solver may
/// evaluate the law at any strain, but uses its values only in the regions of the law.
///
/// With [`Split::VolumetricDeviatoric`](crate::Split), damage does not degrade U(J) = ψ(J^(1/3) I) in compression;
/// the user need not define U. ψ⁺ = ψ − U must not be negative: at a given volume, the energy must be smallest for
/// the pure change of volume. This holds if the larger stretch always has the larger stress (Baker & Ericksen, J.
/// Wash. Acad. Sci. 44 (1954) 33).
///
/// # Example
/// Blatz & Ko's foam rubber, ψ = μ/2 (I₂/I₃ + 2 J − 5):
/// ```
/// use fem::{HyperelasticLaw, Material, PrincipalStrain, Scalar};
///
/// #[derive(Debug)]
/// struct BlatzKo {
///     shear_mpa: f64,
/// }
///
/// impl HyperelasticLaw for BlatzKo {
///     #[inline(always)]
///     fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
///         // I₂/I₃ − 3 = Σ (λ_i⁻² − 1)
///         let shape = strain.power_sum(-2.0);
///         let volume = strain.log_volume().exp_m1() * 2.0;
///         (shape + volume) * (self.shear_mpa / 2.0)
///     }
/// }
///
/// let foam = Material::hyperelastic(BlatzKo { shear_mpa: 0.4 })?;
/// fem::assert_material(&foam, None);
/// let foam = foam.elasticity;
/// assert!((foam.poisson() - 0.25).abs() < 1e-12 && (foam.young_mpa() - 1.0).abs() < 1e-12);
/// # Ok::<(), fem::FemError>(())
/// ```
pub trait HyperelasticLaw: Debug + Send + Sync + 'static {
    /// Returns ψ at the given strain, MPa. Write `#[inline(always)]`, so that the function is compiled with vector
    /// instructions.
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T;
}

/// User-defined law given by its energy, as stored in [`Elasticity::User`](crate::Elasticity::User).
///
/// Created by [`Material::hyperelastic`](crate::Material::hyperelastic). Clones share the law; two values are equal
/// if they share the same law.
#[derive(Clone, Debug, PartialEq)]
pub struct UserLaw {
    law: OverScalars<Energies>,
    young_mpa: f64,
    poisson: f64,
}

/// [`Family`] of the user-defined laws given by their energy.
struct Energies;

impl Family for Energies {
    type Over<T: Scalar> = dyn EnergyDerivatives<T>;
}

impl<L: HyperelasticLaw> MemberOf<Energies> for L {
    fn over<T: Scalar>(self: Arc<Self>) -> Arc<dyn EnergyDerivatives<T>> {
        self
    }
}

/// Object-safe interface to the derivatives of an energy.
trait EnergyDerivatives<T: Scalar>: Debug + Send + Sync {
    /// Returns energy and stress.
    fn stress(&self, strains: &Strains<T>) -> ElasticResponse<T>;

    /// Returns energy, stress and tangent.
    fn tangent(&self, strains: &Strains<T>) -> ElasticResponse<T>;

    /// Returns the energy U(t) of a pure change of volume with t = ln J, and its derivatives U′ and U″, MPa. Each
    /// strain is t/3.
    fn volumetric(&self, t: T) -> [T; 3];
}

impl<T: Scalar, L: HyperelasticLaw> EnergyDerivatives<T> for L {
    fn stress(&self, strains: &Strains<T>) -> ElasticResponse<T> {
        strains.log[0].vectorize(Stress { law: self, strains })
    }

    fn tangent(&self, strains: &Strains<T>) -> ElasticResponse<T> {
        strains.log[0].vectorize(Tangent { law: self, strains })
    }

    fn volumetric(&self, t: T) -> [T; 3] {
        t.vectorize(Volumetric { law: self, t })
    }
}

/// Evaluation of energy and stress, compiled with the processor instructions (such as AVX2) for the
/// number type `T`.
struct Stress<'a, T, L> {
    law: &'a L,
    strains: &'a Strains<T>,
}

impl<T: Scalar, L: HyperelasticLaw> Computation for Stress<'_, T, L> {
    type Output = ElasticResponse<T>;

    #[inline(always)]
    fn run(self) -> ElasticResponse<T> {
        let psi: Jet<T, 3, 0> = self.law.energy(&variables(self.strains));
        ElasticResponse { energy: psi.value, stress: psi.first, ..ElasticResponse::zero(psi.value) }
    }
}

/// Evaluation of energy, stress and tangent, compiled with the processor instructions (such as
/// AVX2) for the number type `T`.
struct Tangent<'a, T, L> {
    law: &'a L,
    strains: &'a Strains<T>,
}

/// Difference of strains below which τ_i − τ_j is computed as an integral instead of a difference.
const NEAR: f64 = 0.02;
/// Four-point Lobatto rule for the mean over [−1, 1]: weight of the ends, weight of the inner points, distance of the
/// inner points from the middle.
const LOBATTO: [f64; 3] = [1.0 / 6.0, 5.0 / 6.0, 0.447_213_595_499_957_9];

impl<T: Scalar, L: HyperelasticLaw> Computation for Tangent<'_, T, L> {
    type Output = ElasticResponse<T>;

    /// Computes energy, stress and tangent.
    ///
    /// For x = ε_i − ε_j → 0, the difference in ½ (τ_i − τ_j) coth x loses its digits, and replacing the term by its
    /// limit has a second-order error. However, τ_i − τ_j is the derivative of ψ(m + δ, m − δ) at δ = x/2, an odd
    /// function of δ. The term is therefore ¼ x coth x times the mean of d²ψ/dδ² over (−δ, δ). At the ends of this
    /// interval d²ψ/dδ² follows from the tangent. The relative error of the mean is (α δ)⁶/23625 for an energy in
    /// λ^α: 1e-15 for α = 2, 1e-12 for α = 6.
    #[inline(always)]
    fn run(self) -> ElasticResponse<T> {
        let Self { law, strains } = self;
        let psi: Jet<T, 3, 6> = law.energy(&variables(strains));
        let (stress, normal, log) = (psi.first, psi.second, strains.log);
        let mut shear = log;
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let x = log[i] - log[j];
            let difference = (stress[i] - stress[j]) * 0.5 * strains.coth[k] / x;
            let far = x.constant(NEAR).less_than(x.abs());
            if T::settled(far) {
                shear[k] = difference;
                continue;
            }
            let middle = (log[i] + log[j]) * 0.5;
            let apart = x * (0.5 * LOBATTO[2]);
            let mut along = [Jet::<T, 1, 1>::fixed(log[k]); 3];
            along[i] = Jet::linear(middle + apart, [1.0]);
            along[j] = Jet::linear(middle - apart, [-1.0]);
            let inner = law.energy(&PrincipalStrain::new(along)).second[0];
            let mixed = normal[packed(i.max(j), i.min(j))];
            let end = normal[packed(i, i)] + normal[packed(j, j)] - (mixed + mixed);
            let mean = inner * LOBATTO[1] + end * LOBATTO[0];
            shear[k] = T::select(far, difference, strains.coth[k] * mean * 0.25);
        }
        ElasticResponse { energy: psi.value, stress, normal, shear }
    }
}

/// Evaluation of U, U′ and U″, compiled with the processor instructions (such as AVX2) for the
/// number type `T`.
struct Volumetric<'a, T, L> {
    law: &'a L,
    t: T,
}

impl<T: Scalar, L: HyperelasticLaw> Computation for Volumetric<'_, T, L> {
    type Output = [T; 3];

    #[inline(always)]
    fn run(self) -> [T; 3] {
        let strain = Jet::<T, 1, 1>::linear(self.t / 3.0, [1.0 / 3.0]);
        let psi = self.law.energy(&PrincipalStrain::new([strain; 3]));
        [psi.value, psi.first[0], psi.second[0]]
    }
}

/// Returns the strains as independent variables for automatic differentiation.
#[inline(always)]
fn variables<T: Scalar, const H: usize>(strains: &Strains<T>) -> PrincipalStrain<Jet<T, 3, H>> {
    let mut log = [Jet::fixed(strains.log[0]); 3];
    let mut excess = log;
    for i in 0..3 {
        log[i] = Jet::variable(strains.log[i], i);
        // w = e^(2ε) − 1
        let slope = (strains.excess[i] + 1.0) * 2.0;
        excess[i] = log[i].chain(strains.excess[i], slope, slope + slope);
    }
    PrincipalStrain::with_excess(log, excess)
}

impl UserLaw {
    /// Checks a law and computes its moduli at small strain.
    ///
    /// # Errors
    /// The errors of [`Material::hyperelastic`](crate::Material::hyperelastic).
    pub(in crate::material) fn new(law: impl HyperelasticLaw) -> Result<Self, FemError> {
        let law = OverScalars::new(law);
        let [young_mpa, poisson] = small_strain(law.single())?;
        Ok(Self { law, young_mpa, poisson })
    }

    /// Returns Young's modulus at small strain, MPa.
    pub(in crate::material) fn young_mpa(&self) -> f64 {
        self.young_mpa
    }

    /// Returns Poisson's ratio at small strain.
    pub(in crate::material) fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Returns whether the energy is a sum of a function of the volume and a function of the isochoric strain: the mean
    /// stress then depends on the volume alone.
    pub(in crate::material) fn is_decoupled(&self) -> bool {
        let law = self.law.single();
        let scale = 1e-9 * self.young_mpa / (1.0 - 2.0 * self.poisson);
        [0.3, 0.03].into_iter().all(|size| {
            let log = STATE.map(|e| size * e);
            let excess = log.map(|e| (2.0 * e).exp_m1());
            let stress = law.stress(&Strains::new(log, excess)).stress;
            let mean = stress.iter().sum::<f64>() / 3.0;
            let [_, alone, _] = law.volumetric(log.iter().sum());
            (mean - alone).abs() <= scale
        })
    }

    /// Returns energy and stress, and the tangent if `TANGENT` is true.
    #[inline(always)]
    pub(in crate::material) fn whole<T: Scalar, const TANGENT: bool>(
        &self,
        strains: &Strains<T>,
    ) -> ElasticResponse<T> {
        let law = self.law.over::<T>();
        if TANGENT { law.tangent(strains) } else { law.stress(strains) }
    }

    /// Returns the energy U(t) of a pure change of volume with t = ln J, and its derivatives U′ and U″, MPa. Each
    /// strain is t/3.
    #[inline(always)]
    pub(in crate::material) fn volumetric<T: Scalar>(&self, t: T) -> [T; 3] {
        self.law.over::<T>().volumetric(t)
    }
}

/// Strains at which the symmetry of a law is checked.
const STATE: [f64; 3] = [0.11, -0.23, 0.05];

/// Returns Young's modulus (MPa) and Poisson's ratio at small strain.
///
/// With D_ij = ∂²ψ/∂ε_i∂ε_j at rest: λ = D_12, 2μ = D_11 − D_12.
///
/// # Errors
/// If the energy is not symmetric in the strains, energy or stress is not zero at rest, or a modulus is not positive.
fn small_strain(law: &dyn EnergyDerivatives<f64>) -> Result<[f64; 2], FemError> {
    let ElasticResponse { energy, stress, normal, .. } =
        law.tangent(&Strains::new([0.0; 3], [0.0; 3]));
    let lame = normal[packed(1, 0)];
    let shear = 0.5 * (normal[packed(0, 0)] - lame);
    let bulk = lame + 2.0 / 3.0 * shear;
    let refuse = |reason| Err(FemError::unsupported(format!("law {law:?}"), reason));
    if !(shear > 0.0 && bulk > 0.0 && shear.is_finite() && bulk.is_finite()) {
        return refuse(Unsupported::ModuliAtRest { bulk_mpa: bulk, shear_mpa: shear });
    }
    let round_off = 1e-10 * (bulk + shear);
    let vanishes = |x: f64| x.abs() <= round_off;
    if !(vanishes(energy) && stress.iter().all(|&x| vanishes(x))) {
        return refuse(Unsupported::StressAtRest);
    }
    let value = |log: [f64; 3]| {
        let excess = log.map(|e| (2.0 * e).exp_m1());
        law.stress(&Strains::new(log, excess)).energy
    };
    // the domain of the law may be limited to small strains: scale the strains until the energy is finite
    let inside = (0..40).map(|k| 0.5f64.powi(k)).find(|s| value(STATE.map(|e| s * e)).is_finite());
    let [a, b, c] = STATE.map(|e| inside.unwrap_or(0.0) * e);
    let first = value([a, b, c]);
    let turned = [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]];
    if !turned.iter().all(|&e| vanishes(value(e) - first)) {
        return refuse(Unsupported::NotSymmetric);
    }
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    Ok([young, 0.5 * lame / (lame + shear)])
}
