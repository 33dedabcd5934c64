//! User-defined law with a state.

use std::fmt::Debug;
use std::sync::Arc;

use crate::error::{FemError, Unsupported};
use crate::material::number::{Computation, Family, MemberOf, OverScalars, Scalar};
use crate::material::principal::Principal;
use crate::material::response::Response;

/// Largest allowed number of state values of a law.
pub(in crate::material) const MOST_STATE: usize = 92;
/// Largest allowed number of state values of a user-defined law.
const MOST_USER_STATE: usize = 32;

/// User-defined law that may have a state, such as viscous or plastic strains.
///
/// The state of a point is a slice of [`state_len`](Self::state_len) numbers, zero before the first increment. The
/// law reads the state at the start of the increment and writes the state at the end. A law may be evaluated several
/// times in an increment, and the state at the start does not change until the increment is accepted.
///
/// The stress must have the principal axes of the strain at the end of the increment. The law itself applies the
/// degradation `g` to its energy, so that [`PhaseField::split`](crate::PhaseField::split) must be `None`;
/// [`ElasticResponse::degraded`](crate::ElasticResponse::degraded) degrades the whole energy.
///
/// # Example
/// A law without state, τ = K tr ε I + 2 μ dev ε:
/// ```
/// use fem::{ConstitutiveLaw, ElasticResponse, Material, Principal, Response, Scalar};
///
/// #[derive(Debug)]
/// struct Quadratic {
///     bulk_mpa: f64,
///     shear_mpa: f64,
/// }
///
/// impl ConstitutiveLaw for Quadratic {
///     fn young_and_poisson(&self) -> [f64; 2] {
///         let (k, g) = (self.bulk_mpa, self.shear_mpa);
///         [9.0 * k * g / (3.0 * k + g), (3.0 * k - 2.0 * g) / (6.0 * k + 2.0 * g)]
///     }
///
///     #[inline(always)]
///     fn respond<T: Scalar>(
///         &self,
///         trial: &Principal<T>,
///         g: T,
///         _dt: T,
///         _old: &[T],
///         _new: &mut [T],
///     ) -> Response<T> {
///         let (e, trace) = (trial.strains.log, trial.strains.trace());
///         let volume = [trace * trace * 0.5, trace, trace.constant(1.0)];
///         let mut out = ElasticResponse::volumetric(volume).times(g.constant(self.bulk_mpa));
///         let shear = g.constant(self.shear_mpa);
///         for i in 0..3 {
///             let deviator = e[i] - trace / 3.0;
///             out.energy += shear * deviator * deviator;
///             out.stress[i] += shear * deviator * 2.0;
///             out.shear[i] = shear * trial.strains.coth[i];
///         }
///         // D_ij = K + 2 μ (δ_ij − 1/3)
///         for (entry, i, j) in [(0, 0, 0), (1, 1, 0), (2, 1, 1), (3, 2, 0), (4, 2, 1), (5, 2, 2)] {
///             out.normal[entry] += shear * if i == j { 4.0 / 3.0 } else { -2.0 / 3.0 };
///         }
///         out.degraded(g)
///     }
/// }
///
/// let material = Material::with_law(Quadratic { bulk_mpa: 180.0, shear_mpa: 110.0 })?;
/// fem::assert_material(&material, None);
/// # Ok::<(), fem::FemError>(())
/// ```
pub trait ConstitutiveLaw: Debug + Send + Sync + 'static {
    /// Returns Young's modulus (MPa) and Poisson's ratio at small strain and zero state.
    fn young_and_poisson(&self) -> [f64; 2];

    /// Returns the number of state values of a point, at most 32.
    fn state_len(&self) -> usize {
        0
    }

    /// Returns energies, stress and consistent tangent for a degradation g. `trial` is the deformation at the end of
    /// the increment, `dt` the duration of the increment in seconds, `old` and `new` the state at the start and at
    /// the end of the increment. Write `#[inline(always)]`, so that the function is compiled with vector
    /// instructions.
    fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T>;
}

/// User-defined law that may have a state, as stored in
/// [`Elasticity::Constitutive`](crate::Elasticity::Constitutive).
///
/// Created by [`Material::with_law`](crate::Material::with_law). Clones share the law; two values are equal if they
/// share the same law.
#[derive(Clone, Debug, PartialEq)]
pub struct UserConstitutiveLaw {
    law: OverScalars<Laws>,
    young_and_poisson: [f64; 2],
    state_len: usize,
}

impl UserConstitutiveLaw {
    /// Checks and stores a law.
    ///
    /// # Errors
    /// The errors of [`Material::with_law`](crate::Material::with_law).
    pub(in crate::material) fn new(law: impl ConstitutiveLaw) -> Result<Self, FemError> {
        let (young_and_poisson, state_len) = (law.young_and_poisson(), law.state_len());
        let law = OverScalars::new(law);
        let refuse = |reason| Err(FemError::unsupported(format!("law {law:?}"), reason));
        if state_len > MOST_USER_STATE {
            let most = MOST_USER_STATE;
            return refuse(Unsupported::StateValues { state_len, most });
        }
        let rest = Principal::new(&[[0.0; 3]; 3]);
        let (old, mut new) = ([0.0; MOST_STATE], [0.0; MOST_STATE]);
        let at_rest =
            law.single().point_response(&rest, 1.0, 1.0, &old[..state_len], &mut new[..state_len]);
        let round_off = 1e-10 * young_and_poisson[0];
        let vanishes = |x: f64| x.abs() <= round_off;
        if !(vanishes(at_rest.energy) && at_rest.stress.into_iter().all(vanishes)) {
            return refuse(Unsupported::StressAtRest);
        }
        Ok(Self { law, young_and_poisson, state_len })
    }

    /// Returns Young's modulus (MPa) and Poisson's ratio at small strain.
    pub(in crate::material) fn young_and_poisson(&self) -> [f64; 2] {
        self.young_and_poisson
    }

    /// Returns the number of state values of a point.
    pub(in crate::material) fn state_len(&self) -> usize {
        self.state_len
    }

    #[inline(always)]
    pub(in crate::material) fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let state = self.state_len;
        self.law.over::<T>().point_response(trial, g, dt, &old[..state], &mut new[..state])
    }
}

/// [`Family`] of the user-defined laws with a state.
struct Laws;

impl Family for Laws {
    type Over<T: Scalar> = dyn PointResponse<T>;
}

impl<L: ConstitutiveLaw> MemberOf<Laws> for L {
    fn over<T: Scalar>(self: Arc<Self>) -> Arc<dyn PointResponse<T>> {
        self
    }
}

/// Object-safe interface to a law with a state.
trait PointResponse<T: Scalar>: Debug + Send + Sync {
    fn point_response(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T>;
}

impl<T: Scalar, L: ConstitutiveLaw> PointResponse<T> for L {
    fn point_response(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        g.vectorize(Evaluation { law: self, trial, g, dt, old, new })
    }
}

/// Evaluation of a law, compiled with the processor instructions (such as AVX2) for the number type
/// `T`.
struct Evaluation<'a, T, L> {
    law: &'a L,
    trial: &'a Principal<T>,
    g: T,
    dt: T,
    old: &'a [T],
    new: &'a mut [T],
}

impl<T: Scalar, L: ConstitutiveLaw> Computation for Evaluation<'_, T, L> {
    type Output = Response<T>;

    #[inline(always)]
    fn run(self) -> Response<T> {
        self.law.respond(self.trial, self.g, self.dt, self.old, self.new)
    }
}
