//! Degradation of the elastic energy by damage: g(φ) = (1 − η) ĝ(φ) + η, with the residual stiffness η.
//!
//! A degradation function implements [`DegradationFunction`]. A function of this crate needs one file, and one line
//! each in [`DegradationLaw`] and [`DegradationLaw::derivatives`].

mod quadratic;
mod user;

pub use user::{DegradationFunction, UserDegradation};

use self::quadratic::Quadratic;
use super::number::Scalar;

/// Degradation function of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum DegradationLaw {
    /// ĝ = (1 − φ)².
    #[default]
    Quadratic,
    User(UserDegradation),
}

impl DegradationLaw {
    /// Returns ĝ, ĝ′ and ĝ″.
    #[inline(always)]
    fn derivatives<T: Scalar>(&self, phi: T) -> [T; 3] {
        match self {
            Self::Quadratic => Quadratic.derivatives(phi),
            Self::User(function) => function.derivatives(phi),
        }
    }
}

/// Degradation of an element, or of one element per SIMD lane.
#[derive(Clone, Copy, Debug)]
pub struct Degradation<'a, T> {
    /// Factor 1 − η of ĝ; zero for a material without damage.
    pub soft: T,
    /// The degradation functions of the mesh.
    pub laws: &'a [DegradationLaw],
    /// Index into `laws`.
    pub law: T,
}

impl<T: Scalar> Degradation<'_, T> {
    /// Returns g, g′ and g″ at φ.
    #[inline(always)]
    pub fn derivatives(&self, phi: T) -> [T; 3] {
        let [value, slope, curvature] = self.without_residual(phi);
        let value = self.soft.mul_add(value, phi.constant(1.0) - self.soft);
        [value, self.soft * slope, self.soft * curvature]
    }

    /// Returns ĝ, ĝ′ and ĝ″ of the selected law, by lane.
    #[inline(always)]
    fn without_residual(&self, phi: T) -> [T; 3] {
        let mut out = [phi.constant(0.0); 3];
        for (k, law) in self.laws.iter().enumerate() {
            let of_law = law.derivatives(phi);
            if self.laws.len() == 1 {
                return of_law;
            }
            let mask = self.law.equals(phi.constant(k as f64));
            for i in 0..3 {
                out[i] = T::select(mask, of_law[i], out[i]);
            }
        }
        out
    }
}
