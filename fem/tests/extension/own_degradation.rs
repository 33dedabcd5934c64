//! A user-defined degradation function: the rational function of cohesive phase-field models.

use crate::test_device::test_device;
use crate::{Run, assert_close};
use fem::{
    CrackDensity, DegradationFunction, Fracture, Material, Order, PhaseField, Scalar,
    assert_material,
};

/// ĝ = (1 − φ)²/((1 − φ)² + a₁ φ (1 + a₂ φ (1 + a₃ φ))).
///
/// Reference: Wu, J. Mech. Phys. Solids 103 (2017) 72, doi:10.1016/j.jmps.2017.03.015.
#[derive(Debug)]
struct Rational {
    a: [f64; 3],
}

impl DegradationFunction for Rational {
    #[inline(always)]
    fn value<T: Scalar>(&self, damage: T) -> T {
        let [a1, a2, a3] = self.a;
        let sound = damage.constant(1.0) - damage;
        let inner = damage * (damage * (damage * a3 + 1.0) * a2 + 1.0) * a1;
        sound * sound / (sound * sound + inner)
    }
}

const A: [f64; 3] = [2.5, -0.5, 0.2];

/// Returns ĝ and ĝ′ from manually derived formulas.
fn by_hand(phi: f64) -> [f64; 2] {
    let [a1, a2, a3] = A;
    let (top, slope_top) = ((1.0 - phi).powi(2), 2.0 * phi - 2.0);
    let inner = a1 * (phi + a2 * phi * phi + a2 * a3 * phi.powi(3));
    let slope_inner = a1 * (1.0 + 2.0 * a2 * phi + 3.0 * a2 * a3 * phi * phi);
    let bottom = top + inner;
    let slope = (slope_top * bottom - top * (slope_top + slope_inner)) / (bottom * bottom);
    [top / bottom, slope]
}

const YOUNG: f64 = 275.0;
const TOUGHNESS: f64 = 0.1;
const LENGTH: f64 = 0.5;
const DISPLACEMENT: f64 = 0.08;
const STEPS: u32 = 8;

fn matrix() -> Material {
    Material::hencky(YOUNG, 0.25).with_fracture(Fracture::new(TOUGHNESS))
}

fn cohesive() -> Material {
    matrix().with_degradation(Rational { a: A }).expect("a degradation function")
}

fn run(order: Order, model: CrackDensity) -> Run {
    let field = Some(PhaseField { model, ..PhaseField::new(LENGTH) });
    Run { order, displacement_mm: DISPLACEMENT, steps: STEPS, grains: false, field }
}

/// Closed form of the force on a homogeneous specimen, divided by the force without damage: ĝ(φ), where φ satisfies
/// ĝ′ ψ + Gc/(c₀ ℓ₀) α′ = 0.
fn ratios(model: CrackDensity) -> Vec<f64> {
    (1..=STEPS)
        .map(|step| {
            let stretch = 1.0 - DISPLACEMENT * f64::from(step) / f64::from(STEPS) / 4.4;
            let energy = 0.5 * YOUNG * stretch.ln().powi(2);
            let unit = TOUGHNESS / (model.normaliser() * LENGTH);
            let force = |phi: f64| by_hand(phi)[1] * energy + unit * model.local(phi)[1];
            let (mut low, mut high) = (0.0, 0.9);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if force(middle) < 0.0 { low = middle } else { high = middle }
            }
            by_hand(low)[0]
        })
        .collect()
}

#[test]
fn the_force_on_a_homogeneous_specimen_agrees_with_the_closed_form() {
    for (order, model) in [
        (Order::Linear, CrackDensity::At2),
        (Order::Quadratic, CrackDensity::At2),
        (Order::Linear, CrackDensity::At1),
    ] {
        let elastic = Run { field: None, ..run(order, model) }.forces(&[matrix()], None);
        let forces = run(order, model).forces(&[cohesive()], None);
        let expected: Vec<f64> =
            elastic.iter().zip(ratios(model)).map(|(force, ratio)| force * ratio).collect();
        assert!(expected[7] < 0.9 * elastic[7], "{expected:?} of {elastic:?}");
        assert_close(&forces, &expected, 1e-6);
    }
}

#[test]
fn a_device_computes_the_degradation_function() {
    let Some(device) = test_device() else { return };
    let run = Run { grains: true, ..run(Order::Quadratic, CrackDensity::At2) };
    // one mesh contains two degradation functions and two laws
    let grain = Material::neo_hookean(2000.0, 0.25).with_fracture(Fracture::new(1.0));
    let [here, there] =
        [None, Some(device)].map(|device| run.forces(&[cohesive(), grain.clone()], device));
    assert_close(&there, &here, 1e-7);
}

#[test]
fn a_law_with_the_degradation_function_passes_the_conformance_test() {
    assert_material(&cohesive(), Some(&PhaseField::new(LENGTH)));
}

#[test]
fn functions_that_do_not_decrease_from_one_to_zero_are_rejected() {
    #[derive(Debug)]
    struct Wrong(f64);
    impl DegradationFunction for Wrong {
        fn value<T: Scalar>(&self, damage: T) -> T {
            (damage.constant(1.0) - damage) * (damage * self.0 + 1.0)
        }
    }
    assert!(matrix().with_degradation(Wrong(0.5)).is_ok());
    let error = matrix().with_degradation(Wrong(2.0)).expect_err("it increases first").to_string();
    assert!(error.contains("does not decrease"), "{error}");
}
