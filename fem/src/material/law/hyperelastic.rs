//! User-defined law, given by its energy; stress and tangent are computed with dual numbers.

use std::fmt::Debug;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector};
use num_dual::{DualNum, gradient, hessian, second_derivative};

use crate::error::{FemError, Unsupported};
use crate::material::principal::Strains;
use crate::material::response::{Whole, packed};
use crate::material::strain::PrincipalStrain;

/// Isotropic hyperelastic law, given by its energy alone.
///
/// ψ, the energy per reference volume in MPa = N mm/mm³, is written once over a generic scalar. It must be a
/// symmetric function of the principal strains, with zero energy and stress at rest. The Kirchhoff stress τ_i =
/// ∂ψ/∂ε_i and the consistent tangent are its derivatives by dual numbers, which are exact also at equal stretches.
/// The law is never evaluated for det F ≤ 0: the solver reduces the step instead.
///
/// With [`Split::VolumetricDeviatoric`](crate::Split), damage does not degrade U(J) = ψ(J^(1/3) I) in compression; U
/// needs no definition by the user. ψ⁺ = ψ − U must not be negative: at a given volume, the energy must be smallest
/// for the pure change of volume. This holds if the larger stretch always has the larger stress (Baker & Ericksen, J.
/// Wash. Acad. Sci. 44 (1954) 33).
///
/// # Example
/// Blatz & Ko's foam rubber, ψ = μ/2 (I₂/I₃ + 2 J − 5):
/// ```
/// use fem::{DualNum, HyperelasticLaw, Material, PrincipalStrain};
///
/// #[derive(Debug)]
/// struct BlatzKo {
///     shear_mpa: f64,
/// }
///
/// impl HyperelasticLaw for BlatzKo {
///     fn energy<T: DualNum<f64> + Copy>(&self, strain: &PrincipalStrain<T>) -> T {
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
    /// Returns ψ at the given strain.
    fn energy<T: DualNum<f64> + Copy>(&self, strain: &PrincipalStrain<T>) -> T;
}

/// User-defined law, as stored in [`Elasticity::User`](crate::Elasticity::User).
///
/// Created by [`Material::hyperelastic`](crate::Material::hyperelastic). Clones share the law; two values are equal
/// if they share the same law.
#[derive(Clone, Debug)]
pub struct UserLaw {
    law: Arc<dyn Derived>,
    young_mpa: f64,
    poisson: f64,
}

impl PartialEq for UserLaw {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::addr_eq(Arc::as_ptr(&self.law), Arc::as_ptr(&other.law))
    }
}

/// Object-safe interface to the derivatives of a law.
trait Derived: Debug + Send + Sync {
    fn value(&self, strain: [f64; 3]) -> f64;

    fn first(&self, strain: [f64; 3]) -> (f64, SVector<f64, 3>);

    fn second(&self, strain: [f64; 3]) -> (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>);

    /// Returns d²ψ/dδ² at ε_i = m + δ, ε_j = m − δ; `strain` contains m at both indices.
    fn spread_curvature(&self, strain: [f64; 3], i: usize, j: usize, delta: f64) -> f64;
}

impl<L: HyperelasticLaw> Derived for L {
    fn value(&self, strain: [f64; 3]) -> f64 {
        self.energy(&PrincipalStrain::new(strain))
    }

    fn first(&self, strain: [f64; 3]) -> (f64, SVector<f64, 3>) {
        gradient(|e| self.energy(&PrincipalStrain::new([e[0], e[1], e[2]])), &SVector::from(strain))
    }

    fn second(&self, strain: [f64; 3]) -> (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>) {
        hessian(|e| self.energy(&PrincipalStrain::new([e[0], e[1], e[2]])), &SVector::from(strain))
    }

    fn spread_curvature(&self, strain: [f64; 3], i: usize, j: usize, delta: f64) -> f64 {
        let along = |d| {
            let mut e = strain.map(num_dual::Dual2_64::from);
            e[i] += d;
            e[j] -= d;
            self.energy(&PrincipalStrain::new(e))
        };
        second_derivative(along, delta).2
    }
}

/// Below this difference of strains, τ_i − τ_j is computed as an integral instead of a difference.
const NEAR: f64 = 0.1;
/// Positive half of the six-point Gauss rule: exact to degree 11 for even functions on [−1, 1].
const GAUSS: [[f64; 2]; 3] = [
    [0.238_619_186_083_196_9, 0.467_913_934_572_691],
    [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
    [0.932_469_514_203_152, 0.171_324_492_379_170_35],
];

impl UserLaw {
    /// Checks a law and computes its moduli at small strain.
    ///
    /// # Errors
    /// As [`Material::hyperelastic`](crate::Material::hyperelastic).
    pub(in crate::material) fn new(law: impl HyperelasticLaw) -> Result<Self, FemError> {
        let [young_mpa, poisson] = small_strain(&law)?;
        Ok(Self { law: Arc::new(law), young_mpa, poisson })
    }

    /// Young's modulus at small strain, MPa.
    pub(in crate::material) fn young_mpa(&self) -> f64 {
        self.young_mpa
    }

    /// Poisson's ratio at small strain.
    pub(in crate::material) fn poisson(&self) -> f64 {
        self.poisson
    }

    /// Returns energy and stress, and the tangent if `tangent` is true.
    ///
    /// For x = ε_i − ε_j → 0, the difference in ½ (τ_i − τ_j) coth x loses its digits, and replacing the term by its
    /// limit has a second-order error. But τ_i − τ_j is the derivative of ψ(m + δ, m − δ) at δ = x/2, an odd function
    /// of δ. The term is therefore ¼ x coth x times the mean of d²ψ/dδ² over (0, δ).
    pub(in crate::material) fn whole(&self, strains: &Strains<f64>, tangent: bool) -> Whole<f64> {
        let strain = strains.log;
        if !tangent {
            let (energy, stress) = self.law.first(strain);
            return Whole { energy, stress: stress.into(), normal: [0.0; 6], shear: [0.0; 3] };
        }
        let (energy, stress, second) = self.law.second(strain);
        let mut normal = [0.0; 6];
        for i in 0..3 {
            (0..=i).for_each(|j| normal[packed(i, j)] = second[(i, j)]);
        }
        let shear = std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let x = strain[i] - strain[j];
            if x.abs() >= NEAR {
                return 0.5 * (stress[i] - stress[j]) * strains.coth[k] / x;
            }
            let mut middle = strain;
            middle[i] = 0.5 * (strain[i] + strain[j]);
            middle[j] = middle[i];
            let mean: f64 = GAUSS
                .iter()
                .map(|[at, w]| w * self.law.spread_curvature(middle, i, j, 0.5 * x * at))
                .sum();
            0.25 * strains.coth[k] * mean
        });
        Whole { energy, stress: stress.into(), normal, shear }
    }

    /// Returns U, U′ and U″ for a pure change of volume with t = ln J, in which each strain is t/3.
    pub(in crate::material) fn of_volume(&self, t: f64) -> [f64; 3] {
        let (energy, stress, second) = self.law.second([t / 3.0; 3]);
        [energy, stress.mean(), second.mean()]
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
fn small_strain(law: &dyn Derived) -> Result<[f64; 2], FemError> {
    let (energy, stress, tangent) = law.second([0.0; 3]);
    let (lame, shear) = (tangent[(0, 1)], 0.5 * (tangent[(0, 0)] - tangent[(0, 1)]));
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
    // scale the strains into the domain of the law, which may be limited to small strains
    let inside =
        (0..40).map(|k| 0.5f64.powi(k)).find(|s| law.value(STATE.map(|e| s * e)).is_finite());
    let [a, b, c] = STATE.map(|e| inside.unwrap_or(0.0) * e);
    let first = law.value([a, b, c]);
    let turned = [[a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]];
    if !turned.iter().all(|&e| vanishes(law.value(e) - first)) {
        return refuse(Unsupported::NotSymmetric);
    }
    let young = 9.0 * bulk * shear / (3.0 * bulk + shear);
    Ok([young, 0.5 * lame / (lame + shear)])
}
