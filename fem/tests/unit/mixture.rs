//! Moduli of mixtures against printed bounds, exact solutions, and their own derivatives.

use num_dual::{Dual2_64, second_derivative};

use super::*;

const RULES: [Homogenisation; 3] =
    [Homogenisation::Reuss, Homogenisation::GeometricMean, Homogenisation::HashinShtrikman];

/// Bulk and shear modulus of E, MPa, and ν.
fn moduli(young: f64, poisson: f64) -> [f64; 2] {
    [young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))]
}

fn mixture(rule: Homogenisation, fraction: f64) -> MixedPhases<f64> {
    MixedPhases { rule, matrix: moduli(275.0, 0.3), grain: moduli(22_000.0, 0.2), fraction }
}

fn at(mixture: &MixedPhases<f64>, g: f64) -> [f64; 2] {
    mixture.moduli(mixture.whole(), g).map(|modulus| modulus.value)
}

fn assert_close(x: f64, y: f64, tolerance: f64) {
    assert!((x - y).abs() <= tolerance * y.abs(), "{x} and {y}");
}

#[test]
fn a_mixture_of_one_phase_is_that_phase() {
    for rule in RULES {
        for g in [1.0, 0.3, 0.01] {
            let [none, all] = [0.0, 1.0].map(|fraction| at(&mixture(rule, fraction), g));
            for k in 0..2 {
                assert_close(none[k], g * moduli(275.0, 0.3)[k], 1e-14);
                // the whole body is grain, which is not damaged
                assert_close(all[k], moduli(22_000.0, 0.2)[k], 1e-13);
            }
        }
    }
}

#[test]
fn rules_are_those_printed() {
    for (fraction, g) in [(0.2, 1.0), (0.5, 1.0), (0.5, 0.2), (0.85, 0.02)] {
        let soft = moduli(275.0, 0.3).map(|m| g * m);
        let hard = moduli(22_000.0, 0.2);
        let reuss = at(&mixture(Homogenisation::Reuss, fraction), g);
        let bound = at(&mixture(Homogenisation::HashinShtrikman, fraction), g);
        let mean = at(&mixture(Homogenisation::GeometricMean, fraction), g);
        let [k, m] = soft;
        let compared =
            [3.0 / (3.0 * k + 4.0 * m), 6.0 * (k + 2.0 * m) / (5.0 * m * (3.0 * k + 4.0 * m))];
        for i in 0..2 {
            assert_close(1.0 / reuss[i], (1.0 - fraction) / soft[i] + fraction / hard[i], 1e-13);
            let above = fraction / (1.0 / (hard[i] - soft[i]) + (1.0 - fraction) * compared[i]);
            assert_close(bound[i], soft[i] + above, 1e-12);
            assert_close(mean[i], (reuss[i] * bound[i]).sqrt(), 1e-13);
            let voigt = (1.0 - fraction) * soft[i] + fraction * hard[i];
            assert!(reuss[i] < mean[i] && mean[i] < bound[i] && bound[i] < voigt);
        }
    }
}

/// Eshelby's sphere, alone in a large body (Mura, Micromechanics of Defects in Solids, 1987).
#[test]
fn few_grains_stiffen_as_eshelbys_sphere() {
    let (fraction, nu) = (1e-7, 0.3);
    let ([k, m], [kg, mg]) = (moduli(275.0, nu), moduli(22_000.0, 0.2));
    let [bulk, shear] = at(&mixture(Homogenisation::HashinShtrikman, fraction), 1.0);
    let exact = (kg - k) * (3.0 * k + 4.0 * m) / (3.0 * kg + 4.0 * m);
    assert_close((bulk - k) / fraction, exact, 1e-5);
    let ratio = mg / m;
    let exact =
        m * 15.0 * (1.0 - nu) * (ratio - 1.0) / (7.0 - 5.0 * nu + 2.0 * (4.0 - 5.0 * nu) * ratio);
    assert_close((shear - m) / fraction, exact, 1e-5);
}

/// Layers loaded across: the stress is the same in all, and so for equal ν the modulus of uniaxial
/// strain K + 4μ/3 and that of shear are the harmonic means.
#[test]
fn layers_across_the_load_are_reuss() {
    let (matrix, grain) = (moduli(275.0, 0.25), moduli(22_000.0, 0.25));
    for fraction in [0.1, 0.5, 0.8] {
        for g in [1.0, 0.2] {
            let layers = MixedPhases { rule: Homogenisation::Reuss, matrix, grain, fraction };
            let [k, m] = at(&layers, g);
            let axial = |[k, m]: [f64; 2]| k + 4.0 / 3.0 * m;
            let series =
                |soft: f64, hard: f64| 1.0 / ((1.0 - fraction) / (g * soft) + fraction / hard);
            assert_close(axial([k, m]), series(axial(matrix), axial(grain)), 1e-13);
            assert_close(m, series(matrix[1], grain[1]), 1e-13);
        }
    }
}

#[test]
fn slopes_and_curvatures_are_derivatives_in_g() {
    for rule in RULES {
        for fraction in [0.0, 0.2, 0.7, 0.9] {
            let own = mixture(rule, fraction);
            let dual = MixedPhases {
                rule,
                matrix: own.matrix.map(Dual2_64::from),
                grain: own.grain.map(Dual2_64::from),
                fraction: fraction.into(),
            };
            for g in [1.0, 0.4, 0.01] {
                let written = own.moduli(own.whole(), g);
                for k in 0..2 {
                    let along = |g| dual.moduli(dual.whole(), g)[k].value;
                    let (value, slope, curvature) = second_derivative(along, g);
                    assert_close(written[k].value, value, 1e-14);
                    assert_close(written[k].slope, slope, 1e-12);
                    let error = (written[k].curvature - curvature).abs();
                    assert!(error < 1e-10 * slope, "{} and {curvature}", written[k].curvature);
                }
            }
        }
    }
}
