//! The neo-Hookean law: ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)².
//!
//! In principal logarithmic strains I₁ = Σ e^{2ε_i}, so τ_i = μ (e^{2ε_i} − 1) + λ tr ε and
//! ½ (τ_i − τ_j) coth(ε_i − ε_j) = μ/2 (e^{2ε_i} + e^{2ε_j}): smooth without any series.

use super::law::{Moduli, Part};

pub(super) fn respond(m: &Moduli, e: [f64; 3]) -> Part {
    let trace = e[0] + e[1] + e[2];
    let s = e.map(|x| (2.0 * x).exp_m1()); // eigenvalues of b − I
    Part {
        energy: 0.5 * m.shear * (s[0] + s[1] + s[2] - 2.0 * trace) + 0.5 * m.lame * trace * trace,
        stress: s.map(|x| m.shear * x + m.lame * trace),
        tangent: std::array::from_fn(|i| {
            std::array::from_fn(|j| m.lame + f64::from(i == j) * 2.0 * m.shear * (1.0 + s[i]))
        }),
        shear: [
            m.shear * (1.0 + 0.5 * (s[1] + s[2])),
            m.shear * (1.0 + 0.5 * (s[2] + s[0])),
            m.shear * (1.0 + 0.5 * (s[0] + s[1])),
        ],
    }
}
