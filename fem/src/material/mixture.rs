//! Moduli of a mixture of matrix and grain in which only the matrix is damaged.
//!
//! The modulus M of a mixture with grain fraction f follows from the moduli M₁ of the matrix and M₂ of the grain,
//! with a comparison medium as soft as the matrix: 1/(M + ζ) = (1 − f)/(M₁ + ζ) + f/(M₂ + ζ). ζ = 0 is the Reuss
//! bound. ζ = 4μ₁/3 for the bulk modulus and ζ = μ₁ (9K₁ + 8μ₁)/(6 (K₁ + 2μ₁)) for the shear modulus is the bound of
//! Hashin and Shtrikman. Damage reduces the matrix modulus to g M₁, and therefore ζ to g ζ. With N = M₂ + g ζ, a = (1
//! − f)/(M₁ + ζ) and D = a N + f g, the modulus is M(g) = g (N/D − ζ). M(g) is smooth for all g, and equals g M₁ for
//! f = 0.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::Scalar;

/// Rule for the moduli of tetrahedra that are partly grain.
///
/// Only the matrix is damaged. The rule is applied to the degraded matrix and the intact grain: K(g K_m, K_g, f) and
/// μ(g μ_m, μ_g, f). The derivatives of these moduli with respect to g drive damage. Toughness and viscosity are
/// multiplied by the matrix fraction 1 − f.
///
/// References: Hill, Proc. Phys. Soc. A 65 (1952) 349, doi:10.1088/0370-1298/65/5/307; Hashin &
/// Shtrikman, J. Mech. Phys. Solids 11 (1963) 127, doi:10.1016/0022-5096(63)90060-7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Homogenisation {
    /// Equal stress in both phases: the lower bound of the stiffness. Exact for a layered material that is loaded
    /// perpendicular to its layers, if the phases have the same Poisson's ratio.
    Reuss,
    /// Lower bound of Hashin and Shtrikman, exact for a small fraction of grains far apart.
    HashinShtrikman,
    /// Geometric mean of `Reuss` and `HashinShtrikman`.
    #[default]
    GeometricMean,
}

/// Grain fraction above which an element has no damage.
pub const MOST_GRAIN: f64 = 0.9;

/// Modulus M as a function of the degradation g.
#[derive(Clone, Copy, Debug)]
pub(super) struct Modulus<T> {
    /// M(1), the modulus without damage.
    pub(super) whole: T,
    /// M(g), the degraded modulus.
    pub(super) value: T,
    /// First derivative M′(g).
    pub(super) slope: T,
    /// Second derivative M″(g).
    pub(super) curvature: T,
}

impl<T: Scalar> Modulus<T> {
    /// Creates the modulus M(g) = g M of a single phase.
    #[inline(always)]
    pub(super) fn proportional(whole: T, g: T) -> Self {
        Self { whole, value: g * whole, slope: whole, curvature: g.constant(0.0) }
    }

    /// Returns M(g) if `share` is one, M(1) if `share` is zero.
    #[inline(always)]
    pub(super) fn degraded(&self, share: T) -> T {
        share.mul_add(self.value - self.whole, self.whole)
    }

    /// Returns this modulus minus `share` times `other`.
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

/// Mixture of matrix and grain, with the bulk and shear modulus of both phases.
#[derive(Clone, Copy, Debug)]
pub struct MixedPhases<T> {
    pub homogenisation: Homogenisation,
    pub matrix: [T; 2],
    pub grain: [T; 2],
    /// Fraction f of the grain.
    pub fraction: T,
}

impl<T: Scalar> MixedPhases<T> {
    /// Returns bulk and shear modulus of the mixture as functions of g. `whole` are the moduli for g = 1.
    #[inline(always)]
    pub(super) fn moduli(&self, whole: [T; 2], g: T) -> [Modulus<T>; 2] {
        let [bulk, shear] = self.ratios(g);
        [bulk.times(whole[0], g), shear.times(whole[1], g)]
    }

    /// Returns bulk and shear modulus for g = 1.
    #[inline(always)]
    pub fn whole(&self) -> [T; 2] {
        let [bulk, shear] = self.ratios(self.fraction.constant(1.0));
        [bulk.value, shear.value]
    }

    /// Returns the shear modulus of the mixture as a function of g, for a matrix with the shear modulus `matrix`. The
    /// field `whole` of the result is a placeholder.
    #[inline(always)]
    pub(super) fn shear(&self, matrix: T, g: T) -> Modulus<T> {
        let phases = Self { matrix: [self.matrix[0], matrix], ..*self };
        let [_, shear] = phases.ratios(g);
        shear.times(g, g)
    }

    /// Returns M(g)/g and its derivatives for the bulk and the shear modulus.
    #[inline(always)]
    fn ratios(&self, g: T) -> [Ratio<T>; 2] {
        let [bulk, shear] = self.matrix;
        let zero = g.constant(0.0);
        let twice = shear + shear;
        let stiffness = g.constant(9.0) * bulk + g.constant(8.0) * shear;
        let compared =
            [g.constant(4.0 / 3.0) * shear, shear * stiffness / (g.constant(6.0) * (bulk + twice))];
        let reuss = [self.ratio(0, zero, g), self.ratio(1, zero, g)];
        if self.homogenisation == Homogenisation::Reuss {
            return reuss;
        }
        let bound = [self.ratio(0, compared[0], g), self.ratio(1, compared[1], g)];
        if self.homogenisation == Homogenisation::HashinShtrikman {
            return bound;
        }
        [reuss[0].geometric_mean(&bound[0]), reuss[1].geometric_mean(&bound[1])]
    }

    /// Returns the ratio M(g)/g = N/D − ζ of one modulus, and the derivatives of this ratio.
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

/// Ratio r = M(g)/g and its derivatives.
#[derive(Clone, Copy)]
struct Ratio<T> {
    value: T,
    slope: T,
    curvature: T,
}

impl<T: Scalar> Ratio<T> {
    /// Returns the geometric mean of two ratios and its derivatives.
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

    /// Returns the modulus M(g) = g r(g) and its derivatives; `whole` is M(1).
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
