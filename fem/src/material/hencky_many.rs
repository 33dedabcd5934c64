//! The Hencky law at several points at once, with any split and a degradation at each point.
//!
//! ψ = κ/2 (tr ε)² + μ Σ d_i² with d_i = ε_i − θ tr ε: (κ, θ) is (K, ⅓), and (λ, 0) for the spectral
//! split. A split says which terms g multiplies: with these shares p (one or zero) the factors are
//! a = 1 + p (g − 1), and so τ_i = κ a₀ tr ε + 2μ a_i d_i, D_ij = κ a₀ + 2μ a_i (δ_ij − θ) and
//! ½ (τ_i − τ_j) coth x = μ x coth x (a_i ε_i − a_j ε_j)/x with x = ε_i − ε_j, where the quotient is
//! the factor itself if both have the same.

#[cfg(test)]
mod tests;

use faer::traits::pulp::Simd;

use super::many::Many;
use super::principal_many::{PrincipalMany, dot};
use super::{Elasticity, PointMaterial, Split};

/// The split that all damaged regions share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HenckyForm {
    split: Split,
    hybrid: bool,
}

impl HenckyForm {
    /// The form of these materials, if all are Hencky solids and what damages has one split.
    pub(crate) fn of(materials: &[PointMaterial]) -> Option<Self> {
        let mut form = None;
        for material in materials {
            if !matches!(material.elasticity, Elasticity::Hencky { .. }) {
                return None;
            }
            if let Some(damage) = &material.damage {
                let own = Self { split: damage.split, hybrid: damage.hybrid };
                if *form.get_or_insert(own) != own {
                    return None;
                }
            }
        }
        Some(form.unwrap_or(Self { split: Split::None, hybrid: false }))
    }

    /// κ and μ of a material, MPa.
    pub(crate) fn moduli(self, material: &PointMaterial) -> [f64; 2] {
        let moduli = &material.moduli;
        let spectral = self.split == Split::Spectral;
        [if spectral { moduli.lame } else { moduli.bulk }, moduli.shear]
    }

    /// The response for κ and μ, and g, at several points.
    #[inline(always)]
    pub(crate) fn respond<S: Simd>(
        self,
        [volumetric, shear]: [Many<S>; 2],
        g: Many<S>,
        principal: &PrincipalMany<S>,
    ) -> ResponseMany<S> {
        let (zero, one) = (g.constant(0.0), g.constant(1.0));
        let twice = shear + shear;
        let e = principal.strain;
        let trace = e[0] + e[1] + e[2];
        let spectral = self.split == Split::Spectral;
        let third = g.constant(if spectral { 0.0 } else { 1.0 / 3.0 });
        let mut deviator = e;
        if !spectral {
            for i in 0..3 {
                deviator[i] = e[i] - third * trace;
            }
        }
        // rest belongs to what g multiplies, as in the law of one point
        let (mut whole, mut terms) = (one, [one; 3]);
        if self.split != Split::None {
            whole = trace.less_than(zero).select(zero, one);
        }
        if spectral {
            for i in 0..3 {
                terms[i] = e[i].less_than(zero).select(zero, one);
            }
        }
        let pressure = volumetric * trace;
        let half = g.constant(0.5);
        let mut driving = whole * half * pressure * trace;
        let mut total = half * pressure * trace;
        for i in 0..3 {
            let term = shear * deviator[i] * deviator[i];
            driving = terms[i].mul_add(term, driving);
            total += term;
        }
        let mut degraded = driving;
        if self.hybrid {
            (whole, terms, degraded) = (one, [one; 3], total);
        }
        let softer = g - one;
        let volumetric_factor = whole.mul_add(softer, one);
        let (mut stress, mut stress_plus, mut deviatoric) = ([zero; 3], [zero; 3], [zero; 3]);
        let mut factor = [zero; 3];
        for i in 0..3 {
            factor[i] = terms[i].mul_add(softer, one);
            deviatoric[i] = twice * factor[i];
            stress[i] = deviatoric[i].mul_add(deviator[i], volumetric_factor * pressure);
            stress_plus[i] = (twice * terms[i]).mul_add(deviator[i], whole * pressure);
        }
        let mut coth = [zero; 3];
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let mut share = factor[i];
            if spectral {
                let quotient = (factor[i] * e[i] - factor[j] * e[j]) / (e[i] - e[j]);
                share = factor[i].equals(factor[j]).select(factor[i], quotient);
            }
            coth[k] = shear * share * principal.coth[k];
        }
        ResponseMany {
            stress,
            stress_plus,
            energy: softer.mul_add(degraded, total),
            driving,
            volumetric: volumetric * volumetric_factor,
            deviatoric,
            third,
            coth,
        }
    }
}

/// Stress and energies at several points, in the principal basis.
#[derive(Clone, Copy)]
pub(crate) struct ResponseMany<S: Simd> {
    /// τ_i with g applied.
    pub(crate) stress: [Many<S>; 3],
    /// τ⁺_i.
    pub(crate) stress_plus: [Many<S>; 3],
    /// g ψ⁺ + ψ⁻.
    pub(crate) energy: Many<S>,
    /// ψ⁺, which drives damage.
    pub(crate) driving: Many<S>,
    /// κ a₀.
    volumetric: Many<S>,
    /// 2μ a_i.
    deviatoric: [Many<S>; 3],
    /// θ.
    third: Many<S>,
    /// ½ (τ_i − τ_j) coth(ε_i − ε_j), at the third index.
    coth: [Many<S>; 3],
}

/// The tangent of [`super::point::Tangent`] at several points, times a weight of each.
#[derive(Clone, Copy)]
pub(crate) struct TangentMany<S: Simd> {
    /// A_il of K_ii = Σ_l A_il g_l g′_l.
    pub(crate) diagonal: [[Many<S>; 3]; 3],
    /// D_ij at the third index.
    pub(crate) normal: [Many<S>; 3],
    /// G_ij at the third index.
    pub(crate) shear: [Many<S>; 3],
}

impl<S: Simd> ResponseMany<S> {
    /// The consistent tangent times `weight`.
    #[inline(always)]
    pub(crate) fn tangent(&self, weight: Many<S>) -> TangentMany<S> {
        let half = weight.constant(0.5);
        let zero = weight.constant(0.0);
        let (mut normal, mut shear) = ([zero; 3], [zero; 3]);
        let mut stress = self.stress;
        for i in 0..3 {
            stress[i] = weight * stress[i];
        }
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            normal[k] = weight * (self.volumetric - self.third * self.deviatoric[i]);
            shear[k] = weight * self.coth[k] - half * (stress[i] + stress[j]);
        }
        let mut diagonal = [[zero; 3]; 3];
        for i in 0..3 {
            for l in 0..3 {
                diagonal[i][l] = if i == l {
                    let own = self.deviatoric[i] - self.third * self.deviatoric[i];
                    weight * (self.volumetric + own) - stress[i]
                } else {
                    shear[3 - i - l] + stress[l]
                };
            }
        }
        TangentMany { diagonal, normal, shear }
    }
}

impl<S: Simd> TangentMany<S> {
    /// The block ∂R_a/∂u_b in the global axes for two spatial gradients in the principal basis,
    /// whose vectors are the columns of `basis`.
    #[inline(always)]
    pub(crate) fn block(
        &self,
        basis: &[[Many<S>; 3]; 3],
        a: &[Many<S>; 3],
        b: &[Many<S>; 3],
    ) -> [[Many<S>; 3]; 3] {
        let mut local = self.diagonal;
        let products = [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
        for i in 0..3 {
            for j in 0..3 {
                local[i][j] = if i == j {
                    dot(&self.diagonal[i], &products)
                } else {
                    let k = 3 - i - j;
                    (self.normal[k] * a[i]).mul_add(b[j], self.shear[k] * a[j] * b[i])
                };
            }
        }
        let mut turned = local;
        for m in 0..3 {
            for j in 0..3 {
                turned[m][j] = dot(&basis[m], &[local[0][j], local[1][j], local[2][j]]);
            }
        }
        let mut out = turned;
        for m in 0..3 {
            for n in 0..3 {
                out[m][n] = dot(&turned[m], &basis[n]);
            }
        }
        out
    }
}
