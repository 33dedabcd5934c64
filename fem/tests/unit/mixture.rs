//! Moduli of mixtures, compared with published bounds, exact solutions, and numerical derivatives.

use num_dual::{Dual2_64, second_derivative};

use super::*;

const RULES: [Homogenisation; 3] =
    [Homogenisation::Reuss, Homogenisation::GeometricMean, Homogenisation::HashinShtrikman];

/// Returns bulk and shear modulus, MPa, from E, MPa, and ν.
fn moduli(young: f64, poisson: f64) -> [f64; 2] {
    [young / (3.0 * (1.0 - 2.0 * poisson)), young / (2.0 * (1.0 + poisson))]
}

fn mixture(rule: Homogenisation, fraction: f64) -> MixedPhases<f64> {
    MixedPhases {
        homogenisation: rule,
        matrix: moduli(275.0, 0.3),
        grain: moduli(22_000.0, 0.2),
        fraction,
    }
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
                // the mixture consists of grain only, and g does not degrade grains
                assert_close(all[k], moduli(22_000.0, 0.2)[k], 1e-13);
            }
        }
    }
}

#[test]
fn homogenisation_rules_agree_with_the_published_formulas() {
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

/// Eshelby's solution for one sphere in a large body (Mura, Micromechanics of Defects in Solids, 1987).
#[test]
fn the_stiffening_by_few_grains_agrees_with_eshelby() {
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

/// Layers normal to the load have equal stress. Therefore, for equal ν, the modulus of uniaxial strain K + 4μ/3 and the
/// shear modulus are harmonic means.
#[test]
fn layers_normal_to_the_load_have_the_moduli_of_reuss() {
    let (matrix, grain) = (moduli(275.0, 0.25), moduli(22_000.0, 0.25));
    for fraction in [0.1, 0.5, 0.8] {
        for g in [1.0, 0.2] {
            let layers =
                MixedPhases { homogenisation: Homogenisation::Reuss, matrix, grain, fraction };
            let [k, m] = at(&layers, g);
            let axial = |[k, m]: [f64; 2]| k + 4.0 / 3.0 * m;
            let series =
                |soft: f64, hard: f64| 1.0 / ((1.0 - fraction) / (g * soft) + fraction / hard);
            assert_close(axial([k, m]), series(axial(matrix), axial(grain)), 1e-13);
            assert_close(m, series(matrix[1], grain[1]), 1e-13);
        }
    }
}

/// Returns twice the energy density of an isotropic material with the moduli [K, μ] for the strains e: 11, 22, 33, 2·23,
/// 2·13, 2·12.
fn isotropic([k, m]: [f64; 2], e: [f64; 6]) -> f64 {
    let volume = e[0] + e[1] + e[2];
    let shear = e[3] * e[3] + e[4] * e[4] + e[5] * e[5];
    let deviator: f64 = e[..3].iter().map(|e| (e - volume / 3.0).powi(2)).sum();
    k * volume * volume + m * (2.0 * deviator + shear)
}

/// Returns twice the exact energy density of a laminate with layers normal to the third axis. The stresses 33, 13, 23 and
/// the strains 11, 22, 12 are equal in all layers (Backus, J. Geophys. Res. 67 (1962) 4427,
/// doi:10.1029/JZ067i011p04427).
fn laminate(phases: [[f64; 2]; 2], fraction: f64, e: [f64; 6]) -> f64 {
    let mean =
        |f: &dyn Fn([f64; 2]) -> f64| (1.0 - fraction) * f(phases[0]) + fraction * f(phases[1]);
    let axial = |[k, m]: [f64; 2]| k + 4.0 / 3.0 * m;
    let lame = |[k, m]: [f64; 2]| k - 2.0 / 3.0 * m;
    let across = 1.0 / mean(&|p| 1.0 / axial(p));
    let drawn = across * mean(&|p| lame(p) / axial(p));
    let sheared = 1.0 / mean(&|p| 1.0 / p[1]);
    let in_plane = mean(&|p| p[1]);
    let coupled = mean(&|p| 2.0 * p[1] * lame(p) / axial(p)) + drawn * drawn / across;
    let along = coupled + 2.0 * in_plane;
    along * (e[0] * e[0] + e[1] * e[1])
        + 2.0 * coupled * e[0] * e[1]
        + across * e[2] * e[2]
        + 2.0 * drawn * (e[0] + e[1]) * e[2]
        + sheared * (e[3] * e[3] + e[4] * e[4])
        + in_plane * e[5] * e[5]
}

/// Bounds by the exact moduli of a laminate. A laminate is at least as stiff as Reuss' mixture and at most as stiff as
/// Voigt's mixture. Under load normal to the layers or shear out of the plane of the layers (phases in series), no rule
/// is softer than the laminate. Under shear in the plane of the layers (phases in parallel), the laminate is stiffer than
/// every rule.
#[test]
fn homogenised_moduli_are_between_the_series_and_parallel_moduli_of_a_laminate() {
    use rand::{Rng, SeedableRng};
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
    for (poisson, g, fraction) in [(0.25, 1.0, 0.2), (0.25, 0.1, 0.6), (0.45, 1.0, 0.5)] {
        let (matrix, grain) = (moduli(275.0, poisson), moduli(22_000.0, 0.25));
        let phases = [matrix.map(|m| g * m), grain];
        let mixed = |rule| at(&MixedPhases { homogenisation: rule, matrix, grain, fraction }, g);
        let voigt = [0, 1].map(|i| (1.0 - fraction) * phases[0][i] + fraction * phases[1][i]);
        let slack = 1.0 + 1e-12;
        for _ in 0..1000 {
            let e: [f64; 6] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
            let exact = laminate(phases, fraction, e);
            assert!(isotropic(mixed(Homogenisation::Reuss), e) <= exact * slack, "{e:?}");
            assert!(exact <= isotropic(voigt, e) * slack, "{e:?}");
        }
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        for rule in RULES {
            let ratio =
                |i: usize| isotropic(mixed(rule), unit(i)) / laminate(phases, fraction, unit(i));
            // under load normal to the layers, Reuss' rule is exact if both phases have the same Poisson's ratio
            for (i, is_exact) in [(2, poisson == 0.25), (3, true), (4, true)] {
                let holds = match rule {
                    Homogenisation::Reuss if is_exact => (ratio(i) - 1.0).abs() < 1e-12,
                    Homogenisation::Reuss => ratio(i) < 1.0,
                    _ => ratio(i) > 1.01,
                };
                assert!(holds, "{rule:?}, {poisson}, strain {i}: {}", ratio(i));
            }
            assert!(ratio(5) < 0.9, "{rule:?}: {}", ratio(5));
        }
    }
}

#[test]
fn slopes_and_curvatures_are_derivatives_with_respect_to_g() {
    for rule in RULES {
        for fraction in [0.0, 0.2, 0.7, 0.9] {
            let mixed = mixture(rule, fraction);
            let dual = MixedPhases {
                homogenisation: rule,
                matrix: mixed.matrix.map(Dual2_64::from),
                grain: mixed.grain.map(Dual2_64::from),
                fraction: fraction.into(),
            };
            for g in [1.0, 0.4, 0.01] {
                let written = mixed.moduli(mixed.whole(), g);
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
