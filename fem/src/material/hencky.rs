//! The Hencky law: ψ = K/2 (tr ε)² + μ dev ε : dev ε in logarithmic strain, with any split.
//!
//! ψ = κ/2 (tr ε)² + μ Σ d_i² with d_i = ε_i − θ tr ε: (κ, θ) is (K, ⅓), and (λ, 0) for the spectral
//! split. A split says which terms g multiplies: with these shares p (one or zero) the factors are
//! a = 1 + p (g − 1), and so τ_i = κ a₀ tr ε + 2μ a_i d_i, D_ij = κ a₀ + 2μ a_i (δ_ij − θ) and
//! ½ (τ_i − τ_j) coth x = μ x coth x (a_i ε_i − a_j ε_j)/x with x = ε_i − ε_j, where the quotient is
//! the factor itself if both have the same: nothing is singular at equal strains.

use super::phase_field::Split;
use super::principal::Strains;
use super::response::{Response, packed};
use super::scalar::Scalar;

/// The response for K and μ, and g.
#[inline(always)]
pub(super) fn respond<T: Scalar, const TANGENT: bool>(
    split: Split,
    hybrid: bool,
    [bulk, shear]: [T; 2],
    strains: &Strains<T>,
    g: T,
) -> Response<T> {
    let (zero, one) = (g.constant(0.0), g.constant(1.0));
    let twice = shear + shear;
    let e = strains.log;
    let trace = strains.trace();
    let spectral = split == Split::Spectral;
    let mut third = g.constant(1.0 / 3.0);
    let mut volumetric = bulk;
    let mut deviator = e;
    if spectral {
        third = zero;
        volumetric = bulk - g.constant(2.0 / 3.0) * shear;
    } else {
        for i in 0..3 {
            deviator[i] = e[i] - third * trace;
        }
    }
    // rest belongs to what g multiplies, so that the parts always add up to the whole
    let (mut whole, mut terms) = (one, [one; 3]);
    if split != Split::None {
        whole = T::select(trace.less_than(zero), zero, one);
    }
    if spectral {
        for i in 0..3 {
            terms[i] = T::select(e[i].less_than(zero), zero, one);
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
    if hybrid {
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
    let (mut normal, mut coth) = ([zero; 6], [zero; 3]);
    if TANGENT {
        let stiffness = volumetric * volumetric_factor;
        for i in 0..3 {
            for j in 0..=i {
                let own = if i == j { deviatoric[i] } else { zero };
                normal[packed(i, j)] = stiffness + (own - third * deviatoric[i]);
            }
        }
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let mut share = factor[i];
            if spectral {
                let quotient = (factor[i] * e[i] - factor[j] * e[j]) / (e[i] - e[j]);
                share = T::select(factor[i].equals(factor[j]), factor[i], quotient);
            }
            coth[k] = shear * share * strains.coth[k];
        }
    }
    let energy = softer.mul_add(degraded, total);
    Response { energy, driving, stress, stress_plus, normal, shear: coth }
}
