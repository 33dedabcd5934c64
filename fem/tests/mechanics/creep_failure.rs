//! Failure under a prescribed force of a body with viscous damage, which has no limit load in the sense of Newton's method.

use crate::support::{HEIGHT, RADIUS, phase_field, prism};
use fem::{
    CompressionTest, End, Fracture, LoadProgram, Material, Order, Outcome, ProgramPoint,
    SegmentSteps, Split,
};

const YOUNG_MPA: f64 = 275.0;
const TOUGHNESS_N_PER_MM: f64 = 0.0025;
const RESIDUAL: f64 = 0.01;
const LENGTH_MM: f64 = 0.06;
const RAMP_S: f64 = 0.1;
const HOLD_S: f64 = 20.0;

/// A cylinder with free sides under a ramp of the force and a hold; its strain and its damage are homogeneous.
fn creep(force_n: f64, viscosity_mpa_s: f64, steps: u32) -> Outcome {
    let points = [
        ProgramPoint { steps: Some(20), ..ProgramPoint::force(RAMP_S, force_n) },
        ProgramPoint::force(RAMP_S + HOLD_S, force_n),
    ];
    let program = LoadProgram::new(points.to_vec()).expect("a program");
    let brittle = Material::hencky(YOUNG_MPA, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: TOUGHNESS_N_PER_MM,
        viscosity_mpa_s,
        residual_stiffness: RESIDUAL,
    });
    CompressionTest::following(program, SegmentSteps::Fixed(steps))
        .builder(prism(2, false))
        .expect("platens")
        .order(Order::Linear)
        .materials([brittle])
        .phase_field(phase_field(Split::None))
        .build()
        .expect("a problem")
        .run(&mut ())
}

/// Time (s) and displacement (mm) at which the residual stiffness η carries half of the force F of the homogeneous body,
/// from ξ dφ/dt = 2 (1 − φ)(1 − η) ψ − Gc φ/ℓ₀ (AT2) with ψ = E ε²/2 and the logarithmic strain ε of
/// ((1 − φ)² (1 − η) + η) E A ε exp(ε) = F. Explicit steps of 0.1 ms.
fn exact(force_n: f64, viscosity_mpa_s: f64) -> [f64; 2] {
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let (mut time_s, mut phi, mut strain, step_s) = (0.0, 0.0_f64, 0.0_f64, 1e-4);
    while time_s < RAMP_S + HOLD_S {
        time_s += step_s;
        let degraded = (1.0 - phi).powi(2) * (1.0 - RESIDUAL) + RESIDUAL;
        if (1.0 - phi).powi(2) < 0.5 * degraded {
            return [time_s, HEIGHT * (1.0 - (-strain).exp())];
        }
        let scaled = force_n * (time_s / RAMP_S).min(1.0) / (degraded * area * YOUNG_MPA);
        for _ in 0..50 {
            strain -= (strain * strain.exp() - scaled) / ((1.0 + strain) * strain.exp());
        }
        let energy = 0.5 * YOUNG_MPA * strain * strain;
        let drive = 2.0 * (1.0 - phi) * (1.0 - RESIDUAL) * energy;
        phi += step_s * (drive - TOUGHNESS_N_PER_MM * phi / LENGTH_MM) / viscosity_mpa_s;
    }
    panic!("the body carries {force_n} N");
}

/// The run ends when the body fails, at the time of the closed form, and not after the residual stiffness has stopped
/// the platen. The number of load steps has no effect on the reason for the end.
#[test]
fn a_creeping_body_ends_when_only_its_residual_stiffness_carries_the_force() {
    for (force_n, viscosity_mpa_s) in [(40.0, 0.3), (60.0, 0.3), (40.0, 0.03)] {
        let [time_s, displacement_mm] = exact(force_n, viscosity_mpa_s);
        for steps in [20, 400] {
            let outcome = creep(force_n, viscosity_mpa_s, steps);
            assert!(matches!(outcome.end, End::LimitLoad), "{:?}", outcome.end);
            let last = outcome.curve.last().expect("points");
            println!(
                "{force_n} N, {viscosity_mpa_s} MPa s, {steps} steps: {:.3} s, {:.3} mm; exact {time_s:.3} s, {displacement_mm:.3} mm",
                last.time_s, last.displacement_mm
            );
            assert!(last.displacement_mm < 1.05 * displacement_mm, "{last:?}");
            assert!(last.phi_max < 0.91, "{last:?}");
            if steps == 400 {
                // half of the error of a load step, 0.05 s, and the distance from the limit, a thousandth of the hold
                assert!((last.time_s - time_s).abs() < 0.05 * time_s + 0.05, "{last:?} {time_s}");
            }
        }
    }
}

/// Below the quasi-static peak force A √(27 E Gc/(256 ℓ₀)) = 21.6 N of AT2, a damaged body carries its force to the end
/// of the program. Above this peak force, a body without viscosity fails during the ramp.
#[test]
fn a_body_fails_under_a_constant_force_only_above_its_quasi_static_peak() {
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let strength = (27.0 * YOUNG_MPA * TOUGHNESS_N_PER_MM / (256.0 * LENGTH_MM)).sqrt();
    let peak_n = area * strength;
    for viscosity_mpa_s in [0.0, 0.3] {
        let outcome = creep(0.8 * peak_n, viscosity_mpa_s, 20);
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let last = outcome.curve.last().expect("points");
        assert!(last.phi_max > 0.02 && last.phi_max < 0.25, "{last:?}");
    }
    let outcome = creep(2.0 * peak_n, 0.0, 20);
    assert!(matches!(outcome.end, End::LimitLoad), "{:?}", outcome.end);
    let last = outcome.curve.last().expect("points");
    assert!(last.time_s < RAMP_S && last.displacement_mm < 0.1, "{last:?}");
}
