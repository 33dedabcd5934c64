//! Moduli of a mixture of matrix and grain, of which only the matrix is damaged.
//!
//! A rule gives the modulus M of a mixture with the grain fraction f from those of its phases, M₁ of
//! the matrix and M₂ of the grain, by a comparison medium as soft as the matrix:
//! 1/(M + ζ) = (1 − f)/(M₁ + ζ) + f/(M₂ + ζ), where ζ = 0 is Reuss' and ζ = 4μ₁/3 for the bulk and
//! μ₁ (9K₁ + 8μ₁)/(6 (K₁ + 2μ₁)) for the shear modulus are Hashin and Shtrikman's. Damage leaves the
//! matrix g M₁, and so ζ becomes g ζ: with N = M₂ + g ζ, a = (1 − f)/(M₁ + ζ) and D = a N + f g,
//! M(g) = g (N/D − ζ), which is smooth for all g and g M₁ without grain.

use serde::{Deserialize, Serialize};

use super::scalar::Scalar;

/// The rule that gives the moduli of tetrahedra which are partly grain.
///
/// Only the matrix in them is damaged: the moduli are those of the rule for the degraded matrix and
/// the whole grain, K(g K_m, K_g, f) and μ(g μ_m, μ_g, f), and their derivative in g drives damage.
/// Toughness and viscosity count for the matrix' share 1 − f.
///
/// References: Hill, Proc. Phys. Soc. A 65 (1952) 349, doi:10.1088/0370-1298/65/5/307; Hashin &
/// Shtrikman, J. Mech. Phys. Solids 11 (1963) 127, doi:10.1016/0022-5096(63)90060-7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Homogenisation {
    /// The same stress in both phases: the least stiff mixture, exact for layers under load across
    /// them if the phases have the same Poisson's ratio.
    Reuss,
    /// Hashin and Shtrikman's lower bound, exact for few grains far apart.
    HashinShtrikman,
    /// The geometric mean of the two.
    #[default]
    GeometricMean,
}

/// Fraction of grain above which a mixture has no damage.
pub const MOST_GRAIN: f64 = 0.9;

/// A modulus M as a function of what damage leaves of the stiffness, g.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modulus<T> {
    /// M(1).
    pub(super) whole: T,
    /// M(g).
    pub(super) value: T,
    /// M′(g).
    pub(super) slope: T,
    /// M″(g).
    pub(super) curvature: T,
}

impl<T: Scalar> Modulus<T> {
    /// g M.
    #[inline(always)]
    pub(super) fn proportional(whole: T, g: T) -> Self {
        Self { whole, value: g * whole, slope: whole, curvature: g.constant(0.0) }
    }

    /// M(g) where the share is one, M(1) where it is zero.
    #[inline(always)]
    pub(super) fn degraded(&self, share: T) -> T {
        share.mul_add(self.value - self.whole, self.whole)
    }

    /// This one less a share of another.
    #[inline(always)]
    pub(super) fn less(self, share: f64, other: &Self) -> Self {
        let share = self.whole.constant(-share);
        Self {
            whole: share.mul_add(other.whole, self.whole),
            value: share.mul_add(other.value, self.value),
            slope: share.mul_add(other.slope, self.slope),
            curvature: share.mul_add(other.curvature, self.curvature),
        }
    }
}

/// A mixture, with the bulk and the shear modulus of its phases.
#[derive(Clone, Copy, Debug)]
pub struct MixedPhases<T> {
    pub rule: Homogenisation,
    pub matrix: [T; 2],
    pub grain: [T; 2],
    /// f.
    pub fraction: T,
}

impl<T: Scalar> MixedPhases<T> {
    /// Bulk and shear modulus where damage leaves g of the matrix; `whole` are those for g = 1.
    #[inline(always)]
    pub(super) fn moduli(&self, whole: [T; 2], g: T) -> [Modulus<T>; 2] {
        let [bulk, shear] = self.ratios(g);
        [bulk.times(whole[0], g), shear.times(whole[1], g)]
    }

    /// The same for g = 1.
    #[inline(always)]
    pub fn whole(&self) -> [T; 2] {
        let [bulk, shear] = self.ratios(self.fraction.constant(1.0));
        [bulk.value, shear.value]
    }

    /// M(g)/g.
    #[inline(always)]
    fn ratios(&self, g: T) -> [Ratio<T>; 2] {
        let [bulk, shear] = self.matrix;
        let zero = g.constant(0.0);
        let twice = shear + shear;
        let stiffness = g.constant(9.0) * bulk + g.constant(8.0) * shear;
        let compared =
            [g.constant(4.0 / 3.0) * shear, shear * stiffness / (g.constant(6.0) * (bulk + twice))];
        let reuss = [self.ratio(0, zero, g), self.ratio(1, zero, g)];
        if self.rule == Homogenisation::Reuss {
            return reuss;
        }
        let bound = [self.ratio(0, compared[0], g), self.ratio(1, compared[1], g)];
        if self.rule == Homogenisation::HashinShtrikman {
            return bound;
        }
        [reuss[0].geometric_mean(&bound[0]), reuss[1].geometric_mean(&bound[1])]
    }

    /// N/D − ζ and its derivatives for a modulus.
    #[inline(always)]
    fn ratio(&self, modulus: usize, comparison: T, g: T) -> Ratio<T> {
        let one = g.constant(1.0);
        let share = (one - self.fraction) / (self.matrix[modulus] + comparison);
        let above = g.mul_add(comparison, self.grain[modulus]);
        let below = one / share.mul_add(above, self.fraction * g);
        let steepness = share.mul_add(comparison, self.fraction);
        let quotient = above * below;
        let slope = (comparison - quotient * steepness) * below;
        let curvature = -((slope + slope) * steepness * below);
        Ratio { value: quotient - comparison, slope, curvature }
    }
}

/// r = M(g)/g and its derivatives.
#[derive(Clone, Copy)]
struct Ratio<T> {
    value: T,
    slope: T,
    curvature: T,
}

impl<T: Scalar> Ratio<T> {
    #[inline(always)]
    fn geometric_mean(&self, other: &Self) -> Self {
        let half = self.value.constant(0.5);
        let value = (self.value * other.value).sqrt();
        let [a, b] = [self.slope / self.value, other.slope / other.value];
        let [c, d] = [self.curvature / self.value, other.curvature / other.value];
        let rate = half * (a + b);
        let bend = half * (c + d - a * a - b * b);
        Self { value, slope: value * rate, curvature: value * rate.mul_add(rate, bend) }
    }

    /// M = g r.
    #[inline(always)]
    fn times(&self, whole: T, g: T) -> Modulus<T> {
        Modulus {
            whole,
            value: g * self.value,
            slope: g.mul_add(self.slope, self.value),
            curvature: g.mul_add(self.curvature, self.slope + self.slope),
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/mixture.rs"]
mod tests;
