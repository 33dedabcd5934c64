//! The Hencky law: ψ = K/2 (tr ε)² + μ dev ε : dev ε in logarithmic strain.
//!
//! τ = K tr ε I + 2μ dev ε. Because τ_i − τ_j = 2μ (ε_i − ε_j), the shear term of the tangent,
//! ½ (τ_i − τ_j) coth(ε_i − ε_j) = μ x coth x, is smooth through equal stretches.

use super::Split;
use super::law::{Moduli, Part, Parts};

pub(super) fn respond(split: Split, m: &Moduli, e: [f64; 3]) -> Parts {
    match split {
        Split::None => Parts { plus: whole(m, e), minus: Part::default() },
        Split::VolumetricDeviatoric => volumetric_deviatoric(m, e),
        Split::Spectral => spectral(m, e),
    }
}

fn whole(m: &Moduli, e: [f64; 3]) -> Part {
    let mut part = deviatoric(m, e);
    add_volumetric(&mut part, m.bulk, e[0] + e[1] + e[2]);
    part
}

fn volumetric_deviatoric(m: &Moduli, e: [f64; 3]) -> Parts {
    let trace = e[0] + e[1] + e[2];
    let (mut plus, mut minus) = (deviatoric(m, e), Part::default());
    add_volumetric(if trace < 0.0 { &mut minus } else { &mut plus }, m.bulk, trace);
    Parts { plus, minus }
}

/// ψ± = λ/2 ⟨tr ε⟩±² + μ Σ ⟨ε_i⟩±².
///
/// The shear term of ψ⁺ is μ r x coth x with r = (⟨ε_i⟩₊ − ⟨ε_j⟩₊)/(ε_i − ε_j), which is one or
/// zero where both strains have one sign: nothing is singular at equal strains.
fn spectral(m: &Moduli, e: [f64; 3]) -> Parts {
    let trace = e[0] + e[1] + e[2];
    let smooth = shears(m, e);
    // rest belongs to ψ⁺, so that the parts of the tangent always add up to the whole
    let side = |stretched: bool| {
        let belongs = |x: f64| (x >= 0.0) == stretched;
        let strain = e.map(|x| if belongs(x) { x } else { 0.0 });
        let on = e.map(|x| f64::from(belongs(x)));
        let mut part = Part {
            energy: m.shear * strain.iter().map(|x| x * x).sum::<f64>(),
            stress: strain.map(|x| 2.0 * m.shear * x),
            tangent: std::array::from_fn(|i| {
                std::array::from_fn(|j| if i == j { 2.0 * m.shear * on[i] } else { 0.0 })
            }),
            shear: std::array::from_fn(|k| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                let share =
                    if on[i] == on[j] { on[i] } else { (strain[i] - strain[j]) / (e[i] - e[j]) };
                share * smooth[k]
            }),
        };
        if belongs(trace) {
            add_volumetric(&mut part, m.lame, trace);
        }
        part
    };
    Parts { plus: side(true), minus: side(false) }
}

fn deviatoric(m: &Moduli, e: [f64; 3]) -> Part {
    let third = (e[0] + e[1] + e[2]) / 3.0;
    let deviator = e.map(|x| x - third);
    Part {
        energy: m.shear * deviator.iter().map(|x| x * x).sum::<f64>(),
        stress: deviator.map(|x| 2.0 * m.shear * x),
        tangent: std::array::from_fn(|i| {
            std::array::from_fn(|j| 2.0 * m.shear * (f64::from(i == j) - 1.0 / 3.0))
        }),
        shear: shears(m, e),
    }
}

/// μ x coth x of the three differences.
fn shears(m: &Moduli, e: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| m.shear * x_coth_x(e[(k + 1) % 3] - e[(k + 2) % 3]))
}

fn add_volumetric(part: &mut Part, modulus: f64, trace: f64) {
    part.energy += 0.5 * modulus * trace * trace;
    for i in 0..3 {
        part.stress[i] += modulus * trace;
        for d in &mut part.tangent[i] {
            *d += modulus;
        }
    }
}

/// x coth x = 1 + x²/3 − x⁴/45 + 2x⁶/945 − x⁸/4725 + …
pub(super) fn x_coth_x(x: f64) -> f64 {
    if x.abs() < 0.05 {
        let s = x * x;
        1.0 + s * (1.0 / 3.0 - s * (1.0 / 45.0 - s * (2.0 / 945.0 - s / 4725.0)))
    } else {
        x / x.tanh()
    }
}
