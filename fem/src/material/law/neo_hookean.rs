//! The neo-Hookean law: ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)².
//!
//! With w_i = λ_i² − 1, τ_i = μ w_i + λ tr ε and ½ (τ_i − τ_j) coth(ε_i − ε_j) = μ (1 + ½ (w_i + w_j)), which is
//! smooth without a series expansion.

use crate::material::number::Scalar;
use crate::material::principal::Strains;
use crate::material::response::{ElasticResponse, packed};

/// Returns energy, stress and tangent for the Lamé constants λ and μ, MPa.
#[inline(always)]
pub(in crate::material) fn whole<T: Scalar>(
    [lame, shear]: [T; 2],
    strains: &Strains<T>,
) -> ElasticResponse<T> {
    let (one, half) = (lame.constant(1.0), lame.constant(0.5));
    let (trace, w) = (strains.trace(), strains.excess);
    let first = w[0] + w[1] + w[2] - (trace + trace);
    let energy = half * (shear * first + lame * trace * trace);
    let (mut stress, mut normal, mut coth) = (w, [lame; 6], w);
    for i in 0..3 {
        stress[i] = shear.mul_add(w[i], lame * trace);
        normal[packed(i, i)] = (shear + shear).mul_add(one + w[i], lame);
        coth[i] = shear * half.mul_add(w[(i + 1) % 3] + w[(i + 2) % 3], one);
    }
    ElasticResponse { energy, stress, normal, shear: coth }
}

/// Returns the energy U(t) of a pure change of volume with t = ln J, and its derivatives U′ and U″, MPa. Each stretch
/// is J^(1/3), and U = 3μ/2 (e^(2t/3) − 1 − 2t/3) + λ/2 t².
#[inline(always)]
pub(in crate::material) fn volumetric<T: Scalar>([lame, shear]: [T; 2], t: T) -> [T; 3] {
    let (half, two_thirds) = (t.constant(0.5), t.constant(2.0 / 3.0));
    let (linear, one) = (two_thirds * t, t.constant(1.0));
    let w = linear.exp_m1();
    [
        t.constant(1.5) * shear * (w - linear) + half * lame * t * t,
        shear.mul_add(w, lame * t),
        (two_thirds * shear).mul_add(one + w, lame),
    ]
}
