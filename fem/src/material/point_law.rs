//! The law at an integration point, and a law that keeps the largest driving energy of damage.

use super::number::{Computation, Scalar};
use super::principal::Principal;
use super::response::Response;

/// Law with the material constants of the current points.
///
/// The state of a point is a slice of [`state_len`](Self::state_len) numbers. It is zero before the first increment.
/// The law reads `old`, the state at the start of the increment, and writes `new`, the state at the end of the
/// increment. A law may be evaluated several times in an increment, and `old` does not change until the increment is
/// accepted.
pub trait PointLaw<T: Scalar> {
    /// Returns the number of state values of a point; zero for an elastic law.
    fn state_len(&self) -> usize;

    /// Returns the trial deformation: the principal strains of F = I + H, or of its elastic part if the law has a plastic
    /// strain in `old`.
    #[inline(always)]
    fn trial(&self, h: &[[T; 3]; 3], _old: &[T]) -> Principal<T> {
        Principal::new(h)
    }

    /// Returns whether stresses may have components outside the principal axes of the strain.
    #[inline(always)]
    fn is_oblique(&self) -> bool {
        false
    }

    /// Returns energies and stress for a degradation g, and the tangent (`normal` and `shear` of [`Response`]) if
    /// `TANGENT` is true. `trial` is the deformation at the end of the increment, `dt` the duration of the increment
    /// in seconds.
    fn respond<const TANGENT: bool>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T>;
}

/// Evaluation of the law at a point. This evaluation is a separate function, so that the laws, which are two thirds
/// of the code of a computation on elements, are compiled once for each number type and not once for each
/// computation.
pub struct AtPoint<'a, T, L, const TANGENT: bool> {
    pub law: &'a L,
    /// Displacement gradient.
    pub h: &'a [[T; 3]; 3],
    pub g: T,
    /// Duration of the increment, s.
    pub dt: T,
    /// State at the start of the increment.
    pub old: &'a [T],
    /// State at the end of the increment.
    pub new: &'a mut [T],
}

impl<T: Scalar, L: PointLaw<T>, const TANGENT: bool> Computation for AtPoint<'_, T, L, TANGENT> {
    type Output = (Principal<T>, Response<T>);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { law, h, g, dt, old, new } = self;
        let principal = law.trial(h, old);
        let response = law.respond::<TANGENT>(&principal, g, dt, old, new);
        (principal, response)
    }
}

/// Law whose damage is driven by the largest driving energy so far, which is the last state value of the point.
///
/// Reference: Miehe, Hofacker & Welschinger, Comput. Methods Appl. Mech. Engrg. 199 (2010) 2765,
/// doi:10.1016/j.cma.2010.04.011.
#[derive(Clone, Copy, Debug)]
pub struct DrivingHistory<L> {
    pub law: L,
    /// Whether the largest driving energy so far is stored. If false, this law equals the inner law.
    pub active: bool,
}

impl<T: Scalar, L: PointLaw<T>> PointLaw<T> for DrivingHistory<L> {
    #[inline(always)]
    fn state_len(&self) -> usize {
        self.law.state_len() + usize::from(self.active)
    }

    #[inline(always)]
    fn trial(&self, h: &[[T; 3]; 3], old: &[T]) -> Principal<T> {
        self.law.trial(h, &old[..self.law.state_len()])
    }

    #[inline(always)]
    fn is_oblique(&self) -> bool {
        self.law.is_oblique()
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
        let last = self.law.state_len();
        let mut out = self.law.respond::<TANGENT>(trial, g, dt, &old[..last], &mut new[..last]);
        if !self.active {
            return out;
        }
        // a driving energy below the largest driving energy so far has no influence: its derivative is zero
        let below = out.driving.less_than(old[last]);
        out.driving_slope = T::select(below, g.constant(0.0), out.driving_slope);
        for i in 0..3 {
            let zero = g.constant(0.0);
            out.driving_stress[i] = T::select(below, zero, out.driving_stress[i]);
            let oblique = &mut out.oblique.driving_stress[i];
            *oblique = T::select(below, zero, *oblique);
        }
        out.driving = out.driving.max(old[last]);
        new[last] = out.driving;
        out
    }
}
