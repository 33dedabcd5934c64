//! Degradation functions from outside the crate.

use std::fmt::Debug;
use std::sync::Arc;

use crate::error::FemError;
use crate::material::number::{Computation, Family, Jet, MemberOf, OverScalars, Scalar};

/// Degradation function ĝ(φ): the fraction of the stiffness that damage φ leaves.
///
/// ĝ falls from ĝ(0) = 1 to ĝ(1) = 0, and is defined in the neighbourhood of [0, 1]. With a residual stiffness η the
/// energy is multiplied by g = (1 − η) ĝ + η. The derivatives ĝ′ and ĝ″ are computed with the function, unless it
/// states them.
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
    /// Returns ĝ(φ). Write `#[inline(always)]`, so that it is compiled with vector instructions.
    fn value<T: Scalar>(&self, damage: T) -> T;

    /// Returns ĝ, ĝ′ and ĝ″. By default the derivatives are computed with the function.
    #[inline(always)]
    fn derivatives<T: Scalar>(&self, damage: T) -> [T; 3] {
        let g = self.value(Jet::<T, 1, 1>::variable(damage, 0));
        [g.value, g.first[0], g.second[0]]
    }
}

/// Degradation function of the user, as stored in [`Material::degradation`](crate::Material::degradation).
///
/// Clones share the function; two values are equal if they share it.
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
            format!("it does not decrease from 1 to 0: its ends are {start} and {end}"),
            "write g with g(0) = 1, g(1) = 0 and a slope that is not positive",
        ))
    }

    /// Returns ĝ, ĝ′ and ĝ″.
    #[inline(always)]
    pub(super) fn derivatives<T: Scalar>(&self, phi: T) -> [T; 3] {
        self.0.over::<T>().all_derivatives(phi)
    }
}

/// The family of degradation functions.
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
    fn all_derivatives(&self, phi: T) -> [T; 3];
}

impl<T: Scalar, L: DegradationFunction> Derivatives<T> for L {
    fn all_derivatives(&self, phi: T) -> [T; 3] {
        phi.vectorize(Evaluation { function: self, phi })
    }
}

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
