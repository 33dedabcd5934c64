//! Hencky's law: ψ = K/2 (tr ε)² + μ dev ε : dev ε in logarithmic strain, with any split of this crate.
//!
//! ψ = κ/2 (tr ε)² + μ Σ d_i² with d_i = ε_i − θ tr ε, where (κ, θ) is (λ, 0) for the spectral split and (K, ⅓)
//! otherwise. A split selects the terms that are degraded: a term with share p = 1 has the modulus M(g), a term with
//! p = 0 has M(1). Hence κ₀ = κ(1) + p₀ (κ(g) − κ(1)), and likewise μ_i. The stress is τ_i = κ₀ tr ε + 2μ_i d_i, the
//! tangent is D_ij = κ₀ + 2μ_i (δ_ij − θ), and ½ (τ_i − τ_j) coth x = x coth x (μ_i ε_i − μ_j ε_j)/x with x = ε_i −
//! ε_j. If μ_i = μ_j, the quotient (μ_i ε_i − μ_j ε_j)/x is this modulus, so that nothing is singular at equal
//! strains. M(g) is g M, or the result of a homogenisation rule for a mixture.

use crate::material::mixture::Modulus;
use crate::material::number::Scalar;
use crate::material::principal::Strains;
use crate::material::response::{ElasticResponse, Response, packed};
use crate::material::split::{Shares, Split};

/// Returns the response for given bulk and shear moduli as functions of g.
#[inline(always)]
pub(in crate::material) fn respond<T: Scalar, const TANGENT: bool>(
    split: Split,
    hybrid: bool,
    [bulk, shear]: &[Modulus<T>; 2],
    strains: &Strains<T>,
) -> Response<T> {
    let e = strains.log;
    let (zero, one) = (e[0].constant(0.0), e[0].constant(1.0));
    let half = e[0].constant(0.5);
    let trace = strains.trace();
    let spectral = split.is_spectral();
    let mut third = e[0].constant(1.0 / 3.0);
    let mut volumetric = *bulk;
    let mut deviator = e;
    if spectral {
        third = zero;
        volumetric = bulk.less(2.0 / 3.0, shear);
    } else {
        for i in 0..3 {
            deviator[i] = e[i] - third * trace;
        }
    }
    let Shares { volume: mut whole, principal: mut terms } = split.shares(strains);
    // the factors ½ (tr ε)² and Σ d_i² of the energy terms that drive damage
    let volume = half * trace * trace;
    let (driven_volume, mut driven_shape) = (whole * volume, zero);
    for i in 0..3 {
        driven_shape = (terms[i] * deviator[i]).mul_add(deviator[i], driven_shape);
    }
    let driving = volumetric.slope.mul_add(driven_volume, shear.slope * driven_shape);
    let driving_slope = volumetric.curvature.mul_add(driven_volume, shear.curvature * driven_shape);
    let (driven_whole, driven_terms) = (whole, terms);
    let (mut stiffness, mut factor) = (volumetric.value, [shear.value; 3]);
    if hybrid {
        (whole, terms) = (one, [one; 3]);
    } else if split != Split::None {
        stiffness = volumetric.degraded(whole);
        for i in 0..3 {
            factor[i] = shear.degraded(terms[i]);
        }
    }
    let mut energy = stiffness * volume;
    let pressure = stiffness * trace;
    let pressure_plus = whole * volumetric.slope * trace;
    let (mut stress, mut stress_plus, mut deviatoric) = ([zero; 3], [zero; 3], [zero; 3]);
    let mut driving_stress = [zero; 3];
    let driving_pressure = driven_whole * volumetric.slope * trace;
    for i in 0..3 {
        deviatoric[i] = factor[i] + factor[i];
        energy = (factor[i] * deviator[i]).mul_add(deviator[i], energy);
        stress[i] = deviatoric[i].mul_add(deviator[i], pressure);
        let slope = terms[i] * shear.slope;
        stress_plus[i] = (slope + slope).mul_add(deviator[i], pressure_plus);
        let driven = driven_terms[i] * shear.slope;
        driving_stress[i] = (driven + driven).mul_add(deviator[i], driving_pressure);
    }
    let (mut normal, mut coth) = ([zero; 6], [zero; 3]);
    if TANGENT {
        for i in 0..3 {
            for j in 0..=i {
                let diagonal = if i == j { deviatoric[i] } else { zero };
                normal[packed(i, j)] = stiffness + (diagonal - third * deviatoric[i]);
            }
        }
        for k in 0..3 {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let mut share = factor[i];
            if spectral {
                let quotient = (factor[i] * e[i] - factor[j] * e[j]) / (e[i] - e[j]);
                share = T::select(factor[i].equals(factor[j]), factor[i], quotient);
            }
            coth[k] = share * strains.coth[k];
        }
    }
    Response {
        energy,
        driving,
        driving_slope,
        stress,
        stress_plus,
        normal,
        shear: coth,
        driving_stress,
        ..Response::zero(zero)
    }
}

/// Returns the deviatoric part of the law, μ dev ε : dev ε.
#[inline(always)]
pub(in crate::material) fn deviatoric<T: Scalar>(
    shear: T,
    strains: &Strains<T>,
) -> ElasticResponse<T> {
    let mut out = ElasticResponse::zero(shear);
    let twice = shear + shear;
    for i in 0..3 {
        let e = strains.log[i] - strains.trace() / 3.0;
        out.energy = (shear * e).mul_add(e, out.energy);
        out.stress[i] = twice * e;
        out.shear[i] = shear * strains.coth[i];
        for k in 0..=i {
            out.normal[packed(i, k)] = twice * if i == k { 2.0 / 3.0 } else { -1.0 / 3.0 };
        }
    }
    out
}

/// Returns the energy U(t) of a pure change of volume with t = ln J, and its derivatives U′ and U″, MPa.
#[inline(always)]
pub(in crate::material) fn volumetric<T: Scalar>(bulk: T, t: T) -> [T; 3] {
    let pressure = bulk * t;
    [pressure * t * 0.5, pressure, bulk]
}
