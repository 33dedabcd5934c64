//! Plastic laws at a point, against closed forms and against a differential equation that this file integrates by itself.

use nalgebra::Matrix3;

use super::conformance::Deformed;
use super::*;

const YOUNG: f64 = 2000.0;
const POISSON: f64 = 0.3;
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));

fn linear(alpha: f64) -> [f64; 2] {
    [12.0 + 25.0 * alpha, 25.0]
}

fn voce(alpha: f64) -> [f64; 2] {
    let rest = (-4.0 * alpha).exp();
    [12.0 + 30.0 * (1.0 - rest), 120.0 * rest]
}

fn swift(alpha: f64) -> [f64; 2] {
    let strain: f64 = 0.02 + alpha;
    [12.0 + 40.0 * (strain.powf(0.3) - 0.02f64.powf(0.3)), 40.0 * 0.3 * strain.powf(-0.7)]
}

fn table(alpha: f64) -> [f64; 2] {
    match alpha {
        a if a < 0.1 => [12.0 + 80.0 * a, 80.0],
        a if a < 0.4 => [20.0 + 20.0 * (a - 0.1), 20.0],
        _ => [26.0, 0.0],
    }
}

/// Yield stress as a function of plastic strain, and its slope.
type YieldStress = fn(f64) -> [f64; 2];

/// Hardening rules with their yield stresses for Y₀ = 12 MPa, written here once more.
fn hardenings() -> [(Hardening, YieldStress); 4] {
    let point = |plastic_strain, hardening_mpa| HardeningPoint { plastic_strain, hardening_mpa };
    [
        (Hardening::Linear { modulus_mpa: 25.0 }, linear),
        (Hardening::Voce { saturation_mpa: 30.0, rate: 4.0 }, voce),
        (Hardening::Swift { factor_mpa: 40.0, offset: 0.02, exponent: 0.3 }, swift),
        (Hardening::Table(vec![point(0.0, 0.0), point(0.1, 8.0), point(0.4, 14.0)]), table),
    ]
}

fn plastic(hardening: Hardening) -> Material {
    let law = Plasticity { hardening, ..Plasticity::new(12.0) };
    Material::hencky(YOUNG, POISSON).with_plasticity(law)
}

/// Deforms a point in uniaxial stress to an axial logarithmic strain, by Newton's method for the lateral strain.
fn uniaxial(point: &PointMaterial, axial: f64, lateral: &mut f64, old: &[f64]) -> Deformed {
    for _ in 0..60 {
        let h = Matrix3::from_diagonal(&[*lateral, *lateral, axial.exp_m1()].into());
        let at = Deformed::from_state(point, &h, 1.0, 1.0, old).expect("det F > 0");
        let (stress, moduli) = (at.piola()[(0, 0)], at.moduli());
        if stress.abs() < 1e-9 {
            return at;
        }
        // both lateral stretches change together
        *lateral -= stress / (moduli[(0, 0)] + moduli[(0, 4)]);
    }
    panic!("the lateral stress does not vanish at the strain {axial}");
}

/// Uniaxial stress up to the logarithmic strain 0.6: τ = σ_y(α) with ln λ = τ/E + α, for each hardening rule.
#[test]
fn uniaxial_tension_has_the_stated_yield_stress() {
    for (hardening, yield_stress) in hardenings() {
        let material = plastic(hardening.clone());
        let point = material.at_point(None);
        let mut old = vec![0.0; material.state_len()];
        let mut lateral = 0.0;
        for step in 1..=30 {
            let axial = 0.02 * f64::from(step);
            let at = uniaxial(&point, axial, &mut lateral, &old);
            // the plastic strain from the closed form, by bisection: τ falls and σ_y rises with it
            let (mut low, mut high) = (0.0, axial);
            for _ in 0..100 {
                let alpha = 0.5 * (low + high);
                let above = YOUNG * (axial - alpha) > yield_stress(alpha)[0];
                if above { low = alpha } else { high = alpha }
            }
            let tau = at.piola()[(2, 2)] * axial.exp();
            let exact = yield_stress(low)[0];
            assert!(
                (tau / exact - 1.0).abs() < 1e-8,
                "{hardening:?}: {tau}, not {exact}, at {axial}"
            );
            assert!((at.state[6] - low).abs() < 1e-8, "{hardening:?}: {} at {axial}", at.state[6]);
            old = at.state;
        }
    }
}

/// Kirchhoff stresses τ₁₁ and τ₁₂ in simple shear by `shear`, by the Runge–Kutta method.
///
/// The elastic strain is ε (n₁ ⊗ n₁ − n₂ ⊗ n₂), where n₁ has the angle θ to the direction of shear. With β = e^(±2ε), the
/// evolution of b_e by shear and coaxial plastic flow is dθ/dγ = (β₂ cos² θ − β₁ sin² θ)/(β₁ − β₂) and dε/dγ = sin θ cos θ −
/// d, where d is the rate of plastic stretch along n₁: dα/dγ = 2 d/√3. On the yield surface, 2√3 μ ε = σ_y(α), so that dε/dγ =
/// σ_y′ d/(3 μ).
fn sheared(yield_stress: YieldStress, shear: f64) -> [f64; 2] {
    let strain = |alpha: f64| yield_stress(alpha)[0] / (2.0 * 3f64.sqrt() * SHEAR);
    let rates = |[theta, alpha]: [f64; 2]| {
        let (sin, cos) = theta.sin_cos();
        let [a, b] = [2.0, -2.0].map(|twice| (twice * strain(alpha)).exp());
        let flow = sin * cos / (1.0 + yield_stress(alpha)[1] / (3.0 * SHEAR));
        [(b * cos * cos - a * sin * sin) / (a - b), 2.0 / 3f64.sqrt() * flow]
    };
    // elastic until yield: ε = asinh(γ/2), tan 2θ = 2/γ
    let first = 2.0 * strain(0.0).sinh();
    assert!(shear > first);
    let mut at = [0.5 * 2f64.atan2(first), 0.0];
    let steps = 40_000;
    let d = (shear - first) / f64::from(steps);
    let moved =
        |at: [f64; 2], rate: [f64; 2], by: f64| [at[0] + by * rate[0], at[1] + by * rate[1]];
    for _ in 0..steps {
        let one = rates(at);
        let two = rates(moved(at, one, 0.5 * d));
        let three = rates(moved(at, two, 0.5 * d));
        let four = rates(moved(at, three, d));
        for k in 0..2 {
            at[k] += d / 6.0 * (one[k] + 2.0 * (two[k] + three[k]) + four[k]);
        }
    }
    let (sin, cos) = (2.0 * at[0]).sin_cos();
    [cos, sin].map(|part| 2.0 * SHEAR * strain(at[1]) * part)
}

/// The material axes rotate in simple shear. The error of the algorithm is of first order in the step, and its
/// extrapolation to zero steps is the solution of the differential equation, up to a shear of 2.5.
#[test]
fn simple_shear_follows_the_differential_equation() {
    for (hardening, yield_stress) in hardenings() {
        let material = plastic(hardening.clone());
        let point = material.at_point(None);
        for end in [0.5, 2.5] {
            let stress = |steps: u32| {
                let mut old = vec![0.0; material.state_len()];
                let mut tau = Matrix3::zeros();
                for step in 1..=steps {
                    let mut h = Matrix3::zeros();
                    h[(0, 1)] = end * f64::from(step) / f64::from(steps);
                    let at = Deformed::from_state(&point, &h, 1.0, 1.0, &old).expect("det F = 1");
                    tau = at.piola() * (Matrix3::identity() + h).transpose();
                    old = at.state;
                }
                assert!(tau[(2, 2)].abs() < 1e-9 && (tau[(0, 0)] + tau[(1, 1)]).abs() < 1e-9);
                [tau[(0, 0)], tau[(0, 1)]]
            };
            let exact = sheared(yield_stress, end);
            let [coarse, fine] = [2000, 4000].map(stress);
            for k in 0..2 {
                let errors = [coarse[k] - exact[k], fine[k] - exact[k]];
                let extrapolated = 2.0 * errors[1] - errors[0];
                assert!(
                    errors[1].abs() < 5e-4 * exact[1] && extrapolated.abs() < 1e-6 * exact[1],
                    "{hardening:?}, shear {end}: {coarse:?}, {fine:?}, exact {exact:?} MPa"
                );
            }
        }
    }
}

/// The cone passes through the compressive corners of Mohr and Coulomb: a bar yields in compression at 2 c cos φ/(1 − sin φ)
/// and keeps this stress without hardening.
#[test]
fn a_cone_has_the_compressive_strength_of_mohr_and_coulomb() {
    for dilatancy_deg in [30.0, 10.0] {
        let criterion = YieldCriterion::DruckerPrager { friction_deg: 30.0, dilatancy_deg };
        let law = Plasticity { criterion, ..Plasticity::new(12.0) };
        let material = Material::hencky(YOUNG, POISSON).with_plasticity(law);
        let point = material.at_point(None);
        let mut old = vec![0.0; material.state_len()];
        let mut lateral = 0.0;
        for step in 1..=20 {
            let axial = -0.01 * f64::from(step);
            let at = uniaxial(&point, axial, &mut lateral, &old);
            let tau = at.piola()[(2, 2)] * axial.exp();
            // 2 · 12 cos 30°/(1 − sin 30°) = 24 √3
            let exact = -(24.0 * 3f64.sqrt()).min(YOUNG * axial.abs());
            assert!((tau / exact - 1.0).abs() < 1e-8, "{tau}, not {exact} MPa, at {axial}");
            old = at.state;
        }
    }
}
