//! The Hencky law: ψ = K/2 (tr ε)² + μ dev ε : dev ε in logarithmic strain.
//!
//! τ = K tr ε I + 2μ dev ε. Because τ_i − τ_j = 2μ (ε_i − ε_j), the shear term of the tangent,
//! ½ (τ_i − τ_j) coth(ε_i − ε_j) = μ x coth x, is smooth through equal stretches.

use super::Split;
use super::law::{Moduli, Part, Parts};

pub(super) fn respond(split: Split, m: &Moduli, e: [f64; 3]) -> Parts {
    let trace = e[0] + e[1] + e[2];
    let deviator = e.map(|x| x - trace / 3.0);
    let mut plus = Part {
        energy: m.shear * deviator.iter().map(|x| x * x).sum::<f64>(),
        stress: deviator.map(|x| 2.0 * m.shear * x),
        tangent: std::array::from_fn(|i| {
            std::array::from_fn(|j| 2.0 * m.shear * (f64::from(i == j) - 1.0 / 3.0))
        }),
        shear: [
            m.shear * x_coth_x(e[1] - e[2]),
            m.shear * x_coth_x(e[2] - e[0]),
            m.shear * x_coth_x(e[0] - e[1]),
        ],
    };
    let mut minus = Part::default();
    let intact = split == Split::VolumetricDeviatoric && trace < 0.0;
    add_volumetric(if intact { &mut minus } else { &mut plus }, m.bulk, trace);
    Parts { plus, minus }
}

fn add_volumetric(part: &mut Part, bulk: f64, trace: f64) {
    part.energy += 0.5 * bulk * trace * trace;
    for i in 0..3 {
        part.stress[i] += bulk * trace;
        for d in &mut part.tangent[i] {
            *d += bulk;
        }
    }
}

/// x coth x = 1 + x²/3 − x⁴/45 + 2x⁶/945 − x⁸/4725 + …
fn x_coth_x(x: f64) -> f64 {
    if x.abs() < 0.05 {
        let s = x * x;
        1.0 + s * (1.0 / 3.0 - s * (1.0 / 45.0 - s * (2.0 / 945.0 - s / 4725.0)))
    } else {
        x / x.tanh()
    }
}
