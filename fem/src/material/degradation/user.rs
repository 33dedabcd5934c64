//! User-defined degradation functions.

use std::fmt::Debug;
use std::sync::Arc;

use crate::error::{FemError, Unsupported};
use crate::material::number::{Computation, Family, Jet, MemberOf, OverScalars, Scalar};

/// Degradation function ĝ(φ): the fraction of the stiffness that remains at damage φ.
///
/// ĝ decreases from ĝ(0) = 1 to ĝ(1) = 0, and must be defined in a neighbourhood of [0, 1]. With a residual stiffness
/// η the energy is multiplied by g = (1 − η) ĝ + η. The derivatives ĝ′ and ĝ″ are computed by automatic
/// differentiation, unless the type implements [`derivatives`](Self::derivatives).
///
/// # Example
/// The rational function of cohesive phase-field models (Wu, J. Mech. Phys. Solids 103 (2017) 72,
/// doi:10.1016/j.jmps.2017.03.015):
/// ```
/// use fem::{DegradationFunction, Material, Scalar};
///
/// #[derive(Debug)]
/// struct Rational {
///     a: [f64; 3],
/// }
///
/// impl DegradationFunction for Rational {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, damage: T) -> T {
///         let [a1, a2, a3] = self.a;
///         let sound = damage.constant(1.0) - damage;
///         let inner = damage * ((damage * a3 + 1.0) * damage * a2 + 1.0) * a1;
///         sound * sound / (sound * sound + inner)
///     }
/// }
///
/// let matrix = Material::hencky(275.0, 0.25).with_degradation(Rational { a: [4.0, -0.5, 0.0] })?;
/// assert!(matrix.degradation.is_some());
/// # Ok::<(), fem::FemError>(())
/// ```
pub trait DegradationFunction: Debug + Send + Sync + 'static {
    /// Returns ĝ(φ). Write `#[inline(always)]`, so that the function is compiled with vector instructions.
    fn value<T: Scalar>(&self, damage: T) -> T;

    /// Returns ĝ, ĝ′ and ĝ″. By default, the derivatives are computed from [`value`](Self::value) by automatic
    /// differentiation.
    #[inline(always)]
    fn derivatives<T: Scalar>(&self, damage: T) -> [T; 3] {
        let g = self.value(Jet::<T, 1, 1>::variable(damage, 0));
        [g.value, g.first[0], g.second[0]]
    }
}

/// User-defined degradation function, as stored in [`Material::degradation`](crate::Material::degradation).
///
/// Clones share the function; two values are equal if they share the same function.
#[derive(Clone, Debug, PartialEq)]
pub struct UserDegradation(OverScalars<Functions>);

impl UserDegradation {
    /// Checks and stores a function.
    ///
    /// # Errors
    /// [`FemError::Unsupported`] if ĝ(0) is not one, ĝ(1) is not zero, or ĝ does not decrease between them.
    pub fn new(function: impl DegradationFunction) -> Result<Self, FemError> {
        let function = Self(OverScalars::new(function));
        let (start, end) = (function.derivatives(0.0)[0], function.derivatives(1.0)[0]);
        let ends = (start - 1.0).abs() < 1e-10 && end.abs() < 1e-10;
        let falls = (0..100).all(|k| function.derivatives(0.01 * f64::from(k))[1] <= 0.0);
        if ends && falls {
            return Ok(function);
        }
        Err(FemError::unsupported(
            format!("degradation function {:?}", function.0),
            Unsupported::Degradation { start, end },
        ))
    }

    /// Returns ĝ, ĝ′ and ĝ″.
    #[inline(always)]
    pub(super) fn derivatives<T: Scalar>(&self, phi: T) -> [T; 3] {
        self.0.over::<T>().all_derivatives(phi)
    }
}

/// [`Family`] of the user-defined degradation functions.
struct Functions;

impl Family for Functions {
    type Over<T: Scalar> = dyn Derivatives<T>;
}

impl<L: DegradationFunction> MemberOf<Functions> for L {
    fn over<T: Scalar>(self: Arc<Self>) -> Arc<dyn Derivatives<T>> {
        self
    }
}

/// Object-safe interface to a degradation function.
trait Derivatives<T: Scalar>: Debug + Send + Sync {
    /// Returns ĝ, ĝ′ and ĝ″.
    fn all_derivatives(&self, phi: T) -> [T; 3];
}

impl<T: Scalar, L: DegradationFunction> Derivatives<T> for L {
    fn all_derivatives(&self, phi: T) -> [T; 3] {
        phi.vectorize(Evaluation { function: self, phi })
    }
}

/// Evaluation of a degradation function, compiled with the processor instructions (such as AVX2)
/// for the number type `T`.
struct Evaluation<'a, T, L> {
    function: &'a L,
    phi: T,
}

impl<T: Scalar, L: DegradationFunction> Computation for Evaluation<'_, T, L> {
    type Output = [T; 3];

    #[inline(always)]
    fn run(self) -> [T; 3] {
        self.function.derivatives(self.phi)
    }
}
